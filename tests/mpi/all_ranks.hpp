// Helpers of the tests across ranks. Every rank runs the same tests; results are gathered on each.
#pragma once

#include <mpi.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include <throng/mpi.hpp>
#include <throng/mpi_cuda.hpp>

#include "apps/mpi/memory.hpp"

namespace throng::mpi {

inline int rank_here() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}
inline int rank_count() {
  int size = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return size;
}

// One thread per rank, and a timeout for every wait.
inline Settings test_settings() {
  Settings settings;
  settings.search.threads = 1;
  settings.timeout_seconds = 60;
  return settings;
}

// A DeviceFinder with device memory emulated in host memory, passed to MPI directly or staged. Has
// the interface of Finder.
template <Buffers buffers>
class EmulatedFinder : public DeviceFinder {
 public:
  explicit EmulatedFinder(MPI_Comm comm, Settings settings) noexcept
      : DeviceFinder(comm, emulated(settings)) {}
  Result find(const RankBoxes& boxes) noexcept { return DeviceFinder::find(boxes, nullptr); }
  Result find(const RankBoxes& a, const RankBoxes& b) noexcept {
    return DeviceFinder::find(a, b, nullptr);
  }

 private:
  static Settings emulated(Settings settings) noexcept {
    settings.search.backend = Backend::emulated;
    settings.buffers = buffers;
    return settings;
  }
};
// A DeviceFinder on the GPU, for boxes in host memory.
class GpuFinder : public DeviceFinder {
 public:
  explicit GpuFinder(MPI_Comm comm, Settings settings) noexcept
      : DeviceFinder(comm, on_gpu(settings)) {}
  Result find(const RankBoxes& boxes) { return DeviceFinder::find(first_.load(boxes), nullptr); }
  Result find(const RankBoxes& a, const RankBoxes& b) {
    const RankBoxes first = first_.load(a), second = second_.load(b);
    return DeviceFinder::find(first, second, nullptr);
  }
  Pairs64 pairs() {
    fetched_ = mpi_app::fetch(DeviceFinder::pairs());
    return {fetched_.data(), fetched_.size()};
  }

 private:
  static Settings on_gpu(Settings settings) noexcept {
    settings.search.backend = Backend::cuda;
    return settings;
  }

  mpi_app::DeviceCopy first_, second_;
  std::vector<Pair64> fetched_;
};

// Typed tests for all finders; the GPU's are skipped without a GPU.
template <class T>
class AnyFinder : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::is_same_v<T, GpuFinder>) return;
    const Result r = cuda::available();
    if (!r.ok()) GTEST_SKIP() << r.message;
  }
};
using Finders = testing::Types<Finder, EmulatedFinder<Buffers::direct>,
                               EmulatedFinder<Buffers::staged>, GpuFinder>;
struct FinderNames {
  template <class T>
  static std::string GetName(int k) {
    return k == 0 ? "Host" : k == 1 ? "Direct" : k == 2 ? "Staged" : "Gpu";
  }
};

// The pairs of all ranks, sorted; duplicates are kept.
inline std::vector<Pair64> from_all(const Pairs64& mine) {
  int count = static_cast<int>(2 * mine.size());
  std::vector<int> counts(static_cast<std::size_t>(rank_count())), starts(counts.size());
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, MPI_COMM_WORLD);
  int total = 0;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    starts[r] = total;
    total += counts[r];
  }
  std::vector<Pair64> all(static_cast<std::size_t>(total) / 2);
  MPI_Allgatherv(mine.data(), count, MPI_UINT64_T, all.data(), counts.data(), starts.data(),
                 MPI_UINT64_T, MPI_COMM_WORLD);
  std::sort(all.begin(), all.end());
  return all;
}

inline std::uint64_t sum_over_ranks(std::uint64_t mine) {
  std::uint64_t sum = 0;
  MPI_Allreduce(&mine, &sum, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
  return sum;
}

inline std::vector<Pair64> widened(const std::vector<Pair>& pairs) {
  std::vector<Pair64> wide;
  for (const Pair pair : pairs) wide.push_back({pair.first, pair.second});
  std::sort(wide.begin(), wide.end());
  return wide;
}

inline std::string difference(const std::vector<Pair64>& found, const std::vector<Pair64>& wanted) {
  std::vector<Pair64> missing, extra;
  std::set_difference(wanted.begin(), wanted.end(), found.begin(), found.end(),
                      std::back_inserter(missing));
  std::set_difference(found.begin(), found.end(), wanted.begin(), wanted.end(),
                      std::back_inserter(extra));
  std::string text = std::to_string(missing.size()) + " missing, " + std::to_string(extra.size()) +
                     " extra of " + std::to_string(wanted.size());
  if (!missing.empty()) {
    text +=
        "; missing " + std::to_string(missing[0].first) + "-" + std::to_string(missing[0].second);
  }
  if (!extra.empty()) {
    text += "; extra " + std::to_string(extra[0].first) + "-" + std::to_string(extra[0].second);
  }
  return text;
}

}  // namespace throng::mpi
