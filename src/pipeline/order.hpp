// Pairs as numbers in their canonical order, and back: what one thread does around a sort of keys.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "pipeline/input.hpp"

namespace throng::pipeline {

// The fewest bits that will do: a radix sort goes through all of them.
struct PairKeys {
  int first_bits, second_bits;

  static PairKeys of(const Input& in) noexcept {
    return {bits_of(in.first_count), bits_of(in.two_sets ? in.count - in.first_count : in.count)};
  }
  // One bit more, which is set in what stands past the last pair.
  int bits() const noexcept {
    return first_bits + second_bits + 1 < 64 ? first_bits + second_bits + 1 : 64;
  }
  THRONG_HD static constexpr std::uint64_t none() noexcept { return ~std::uint64_t{0}; }
  THRONG_HD std::uint64_t key(const Pair& p) const noexcept {
    return std::uint64_t{p.first} << second_bits | p.second;
  }
  THRONG_HD Pair pair(std::uint64_t key) const noexcept {
    return {static_cast<std::uint32_t>(key >> second_bits),
            static_cast<std::uint32_t>(key & ((std::uint64_t{1} << second_bits) - 1))};
  }

 private:
  // Of indices below `count`.
  static int bits_of(std::uint64_t count) noexcept {
    int bits = 1;
    while (bits < 32 && count > std::uint64_t{1} << bits) ++bits;
    return bits;
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
    keys[i] = i < report->found && report->found <= capacity ? shape.key(p) : PairKeys::none();
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
