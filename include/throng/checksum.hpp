// An order-independent checksum of a set of pairs.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

namespace throng {

// The splitmix64 generator: maps 64 bits to 64 well-mixed bits; a bijection.
constexpr std::uint64_t mix64(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

// Returns the sum mod 2^64 of mix64(first << 32 | second). Checksums of blocks of pairs add up.
inline std::uint64_t pair_checksum(const Pair* pairs, std::size_t count) noexcept {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += mix64(std::uint64_t{pairs[i].first} << 32 | pairs[i].second);
  }
  return sum;
}

}  // namespace throng
