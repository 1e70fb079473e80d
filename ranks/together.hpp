// What fails on one rank fails on all, in the same words.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <functional>
#include <string>

#include <throng/options.hpp>

#include "program/remedy.hpp"

namespace throng::ranks {

int rank_of(MPI_Comm comm);
int size_of(MPI_Comm comm);
std::uint64_t sum_of(std::uint64_t mine, MPI_Comm comm);
std::uint64_t most_of(std::uint64_t mine, MPI_Comm comm);

// Collective: runs f on every rank. Where it throws on some, every rank throws program::Failure
// with the words of the first of them.
void together(MPI_Comm comm, const std::function<void()>& f);

// The same on every rank already: throws Failure with what is wrong and what helps, `name` before
// it.
void require_ok(const Result& result, const std::string& name, const program::Remedies& remedies);

// Rank 0 writes to standard output.
void say(const std::string& text, MPI_Comm comm);

}  // namespace throng::ranks
