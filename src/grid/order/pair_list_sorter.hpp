// The last step of sorting pairs by lists: each list holds the pairs of one `first`, at its final
// place, with its seconds still unsorted.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {

class PairListSorter {
 public:
  // Sorts `count` pairs into `to`. `seconds` has two values per pair and may alias `to`; each
  // list's values lie in the latter half of its place. ends[f] is the end of list first_above + f,
  // in values.
  PairListSorter(const std::uint32_t* seconds, Pair* to, std::size_t count,
                 const std::uint32_t* ends, std::uint32_t first_above,
                 unsigned second_bits) noexcept;

  // Limits: lists per call of sort(), and pairs in all, so that ends fit 32 bits.
  static constexpr std::size_t max_lists = 1024;
  static constexpr std::size_t max_pairs = 0x7fffffff;
  // Size of `scratch` in 64-bit values, given the pairs of the longest list: at max_lists max(count
  // of all pairs, `scratch_pairs`).
  std::size_t scratch_size(std::size_t longest) const noexcept;
  static constexpr std::size_t scratch_pairs = 65536;

  // Sorts the lists begin .. end-1. `spare` has space for all pairs and replaces `scratch` for
  // lists that are too long for it; null if there are none.
  void sort(const Kernels&, std::size_t begin, std::size_t end, std::uint64_t* scratch,
            Pair* spare) const;

 private:
  std::uint32_t length_class(std::uint32_t count) const noexcept;

  const std::uint32_t* seconds_;
  Pair* to_;
  const std::uint32_t* ends_;
  std::uint32_t first_above_;
  unsigned second_bits_;
  std::uint32_t max_rows_;  // longer lists are sorted alone
};

}  // namespace throng::grid
