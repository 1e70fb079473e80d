// Sorted order: a radix sort of pairs.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>
#include <throng/types.hpp>

#include "base/memory.hpp"
#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {

class PairSorter {
 public:
  explicit PairSorter(base::Memory& memory) noexcept : histograms_(memory), scratch_(memory) {}

  // Sorts the `count` pairs of `from` by first, then second, into `to`; overwrites `from`. Every
  // first is below first_count, every second below second_count.
  void sort(const Kernels& kernels, const Executor& executor, unsigned task_count, Pair* from,
            Pair* to, std::size_t count, std::uint64_t first_count, std::uint64_t second_count);
  std::size_t held() const noexcept { return histograms_.bytes() + scratch_.bytes(); }
  // Lower bound on the scratch bytes for sorting `count` pairs.
  static std::size_t bytes_for(std::size_t count, unsigned task_count) noexcept;

 private:
  struct Job {
    const Kernels& kernels;
    const Executor& executor;
    unsigned tasks;
    Pair *from, *to;
    std::size_t count;
    std::uint64_t first_count, second_count;
  };
  void sort_as_lists(const Job&);
  void sort_as_buckets(const Job&);

  base::Buffer<std::uint64_t> histograms_;
  base::Buffer<std::uint64_t> scratch_;  // of all tasks
};

}  // namespace throng::grid
