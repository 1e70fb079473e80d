#include "apps/mpi/collective.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>

#include <fmt/format.h>

#include "apps/common/failure.hpp"
#include "apps/common/print.hpp"

namespace throng::mpi_app {

int rank_of(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}
int size_of(MPI_Comm comm) {
  int size = 1;
  MPI_Comm_size(comm, &size);
  return size;
}
std::uint64_t sum_over_ranks(std::uint64_t mine, MPI_Comm comm) {
  std::uint64_t sum = 0;
  MPI_Allreduce(&mine, &sum, 1, MPI_UINT64_T, MPI_SUM, comm);
  return sum;
}
std::uint64_t max_over_ranks(std::uint64_t mine, MPI_Comm comm) {
  std::uint64_t most = 0;
  MPI_Allreduce(&mine, &most, 1, MPI_UINT64_T, MPI_MAX, comm);
  return most;
}

void run_collectively(MPI_Comm comm, const std::function<void()>& f) {
  constexpr std::size_t capacity = 1000;
  char words[capacity] = "";
  bool failed = true;
  try {
    f();
    failed = false;
  } catch (const std::bad_alloc&) {
    std::strcpy(words, "out of memory");
  } catch (const std::exception& failure) {
    std::snprintf(words, capacity, "%s", failure.what());
  }
  const auto size = static_cast<std::uint64_t>(size_of(comm));
  const auto rank = static_cast<std::uint64_t>(rank_of(comm));
  const std::uint64_t first = max_over_ranks(failed ? size - rank : 0, comm);
  if (first == 0) return;
  const int root = static_cast<int>(size - first);
  MPI_Bcast(words, capacity, MPI_CHAR, root, comm);
  throw common::Failure(size == 1 ? std::string(words) : fmt::format("rank {}: {}", root, words));
}

void require_ok(const Result& result, const std::string& name,
                const common::HintOptions& hint_options) {
  if (result.ok()) return;
  throw common::Failure(fmt::format("{}: {}", name, common::failure_text(result, hint_options)));
}

void say(const std::string& text, MPI_Comm comm) {
  run_collectively(comm, [&] {
    if (rank_of(comm) == 0) common::print(text);
  });
}

}  // namespace throng::mpi_app
