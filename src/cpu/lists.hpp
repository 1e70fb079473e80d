// Lists of the canonical order's sort: the pairs of a first, each list in its place among those of
// other firsts, but its seconds in any order.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

#include "cpu/kernels.hpp"

namespace throng::cpu {

class Lists {
 public:
  // `count` pairs, which will lie sorted in `to`. Their seconds lie in `seconds`, which has room
  // for two numbers a pair and may be `to` itself, each list's in the latter half of its place.
  // ends[f]: where there the place of the list of first first_above + f ends.
  Lists(const std::uint32_t* seconds, Pair* to, std::size_t count, const std::uint32_t* ends,
        std::uint32_t first_above, unsigned second_bits) noexcept;

  // How many are sorted in one go, at most; and pairs in all, so that ends fit 32 bits.
  static constexpr std::size_t most = 1024;
  static constexpr std::size_t most_pairs = 0x7fffffff;
  // Numbers of 64 bits that this takes room for; `longest`: the pairs of the longest list. At most
  // the count of all pairs, and `scratch_pairs` where that is more.
  std::size_t room_for(std::size_t longest) const noexcept;
  static constexpr std::size_t scratch_pairs = 65536;

  // Sorts the lists begin .. end-1. `spare` has room for all pairs, and stands in where a list is
  // too long for `room`; null where none is.
  void sort(const Kernels&, std::size_t begin, std::size_t end, std::uint64_t* room,
            Pair* spare) const;

 private:
  std::uint32_t class_of(std::uint32_t count) const noexcept;

  const std::uint32_t* seconds_;
  Pair* to_;
  const std::uint32_t* ends_;
  std::uint32_t first_above_;
  unsigned second_bits_;
  std::uint32_t most_rows_;  // a longer list is not sorted beside others
};

}  // namespace throng::cpu
