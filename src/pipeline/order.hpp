// Pairs as numbers in their canonical order, and back: what one thread does around a sort of keys.
#pragma once

#include <bit>
#include <cstdint>

#include <throng/types.hpp>

#include "pipeline/input.hpp"

namespace throng::pipeline {

// A pair's number among all that there could be: the fewest bits that will do, for a radix sort
// goes through all of them.
struct PairKeys {
  std::uint64_t firsts, seconds;  // as many indices there are of either

  static PairKeys of(const Input& in) noexcept {
    return {in.first_count, in.two_sets ? in.count - in.first_count : in.count};
  }
  // Of what stands past the last pair, too.
  int bits() const noexcept { return none() > 0 ? static_cast<int>(std::bit_width(none())) : 1; }
  // Indices are below max_pipeline_boxes.
  THRONG_HD constexpr std::uint64_t none() const noexcept { return firsts * seconds; }
  THRONG_HD std::uint64_t key(const Pair& p) const noexcept { return p.first * seconds + p.second; }
  THRONG_HD Pair pair(std::uint64_t key) const noexcept {
    const std::uint64_t first = key / seconds;
    return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(key - first * seconds)};
  }
};

// Past the last pair, or where they do not fit at all, the greatest key.
struct PackPairs {
  const Pair* pairs;
  std::uint64_t* keys;  // on a device it may be the same memory
  const Report* report;
  std::uint64_t capacity;
  PairKeys shape;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = pairs[i];
    keys[i] = i < report->found && report->found <= capacity ? shape.key(p) : shape.none();
  }
};
struct UnpackPairs {
  const std::uint64_t* keys;
  Pair* pairs;
  const Report* report;
  std::uint64_t capacity;
  PairKeys shape;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (i < report->found && report->found <= capacity) pairs[i] = shape.pair(keys[i]);
  }
};

}  // namespace throng::pipeline
