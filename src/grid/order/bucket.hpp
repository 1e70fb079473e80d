// A bucket of the sort into canonical order: pairs whose firsts differ only in the low bits.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {

struct Bucket {
  Pair* pairs;
  std::size_t count;
  unsigned first_bits;        // low bits of first, which differ
  std::uint32_t first_above;  // the high bits, equal for all
  unsigned second_bits;

  unsigned key_bits() const noexcept { return first_bits + second_bits; }
  // 64-bit words of scratch space. Half is enough, but may be slower.
  static constexpr std::size_t scratch_size(std::size_t count) noexcept { return 2 * count; }
};

// Sorts by first, then second, in place.
void sort_bucket(const Kernels&, const Bucket&, std::uint64_t* scratch, std::size_t scratch_count);
// Same result, always by radix sort.
void radix_sort_bucket(const Bucket&, std::uint64_t* scratch, std::size_t scratch_count);

}  // namespace throng::grid
