// Pairs as integers in sorted order, and back: the steps before and after a sort of keys.
#pragma once

#include <bit>
#include <cstdint>

#include <throng/types.hpp>

#include "device/input.hpp"

namespace throng::device {

// The rank of a pair among all possible pairs. It has the fewest bits, and a radix sort's cost
// grows with them.
struct PairKeys {
  std::uint64_t firsts, seconds;  // number of first and second indices

  static PairKeys of(const Input& in) noexcept {
    return {in.first_count, in.two_sets ? in.count - in.first_count : in.count};
  }
  // Includes none(), the key past the last pair.
  int bits() const noexcept { return none() > 0 ? static_cast<int>(std::bit_width(none())) : 1; }
  // The product fits: indices are below max_pipeline_boxes.
  THRONG_HD constexpr std::uint64_t none() const noexcept { return firsts * seconds; }
  THRONG_HD std::uint64_t key(const Pair& p) const noexcept { return p.first * seconds + p.second; }
  THRONG_HD Pair pair(std::uint64_t key) const noexcept {
    const std::uint64_t first = key / seconds;
    return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(key - first * seconds)};
  }
};

// Entries past the last pair, or all if the pairs do not fit, get the greatest key.
struct EncodePairs {
  const Pair* pairs;
  std::uint64_t* keys;  // on a device this may be the memory of `pairs`
  const Report* report;
  std::uint64_t capacity;
  PairKeys shape;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = pairs[i];
    keys[i] = i < report->found && report->found <= capacity ? shape.key(p) : shape.none();
  }
};
struct DecodePairs {
  const std::uint64_t* keys;
  Pair* pairs;
  const Report* report;
  std::uint64_t capacity;
  PairKeys shape;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (i < report->found && report->found <= capacity) pairs[i] = shape.pair(keys[i]);
  }
};

}  // namespace throng::device
