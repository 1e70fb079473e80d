// A bucket of the canonical order's sort: pairs whose firsts agree but in their last bits.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

#include "cpu/kernels.hpp"

namespace throng::cpu {

struct Bucket {
  Pair* pairs;
  std::size_t count;
  unsigned first_bits;        // the last bits of first, which differ
  std::uint32_t first_above;  // the others, which do not
  unsigned second_bits;

  unsigned key_bits() const noexcept { return first_bits + second_bits; }
  // Numbers of 64 bits that sorting it takes room for. Half of them do, but it may be slower.
  static constexpr std::size_t room_for(std::size_t count) noexcept { return 2 * count; }
};

// By first, then second, in place.
void sort_bucket(const Kernels&, const Bucket&, std::uint64_t* room, std::size_t room_count);
// The same by digits, whatever the pairs.
void sort_by_digits(const Bucket&, std::uint64_t* room, std::size_t room_count);

}  // namespace throng::cpu
