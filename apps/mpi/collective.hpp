// A failure on one rank becomes the failure of all, with the same message.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <functional>
#include <string>

#include <throng/options.hpp>

#include "apps/common/failure_text.hpp"

namespace throng::mpi_app {

int rank_of(MPI_Comm comm);
int size_of(MPI_Comm comm);
std::uint64_t sum_over_ranks(std::uint64_t mine, MPI_Comm comm);
std::uint64_t max_over_ranks(std::uint64_t mine, MPI_Comm comm);

// Collective. Runs f on every rank. If it throws on some, every rank throws common::Failure with
// the message of the first of them.
void run_collectively(MPI_Comm comm, const std::function<void()>& f);

// For a result that is equal on all ranks: throws Failure with the error and its fix, prefixed by
// `name`.
void require_ok(const Result& result, const std::string& name,
                const common::HintOptions& hint_options);

// Collective. Rank 0 writes to standard output.
void say(const std::string& text, MPI_Comm comm);

}  // namespace throng::mpi_app
