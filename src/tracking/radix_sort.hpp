// Radix sorts of pairs with their slots, and of query results.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <throng/broad_phase.hpp>

namespace throng::tracking {

// By first, then second; ids are below `limit`. `scratch`: as many elements.
void sort_pairs(LivePair* pairs, LivePair* scratch, std::size_t count, std::size_t limit) noexcept;
// By object. Below radix_sort_threshold elements `scratch` is unused.
constexpr std::size_t radix_sort_threshold = 48;
void sort_hits(SweepHit* hits, SweepHit* scratch, std::size_t count, std::size_t limit) noexcept;

// Loads both ids of a Pair or a LivePair as one integer: compilers that see two values load a
// vector and then wait to extract them.
inline std::uint64_t ids_at(const void* pair) noexcept {
  std::uint64_t ids;
  static_assert(offsetof(LivePair, second) == 4 && offsetof(Pair, second) == 4);
  std::memcpy(&ids, pair, sizeof ids);
  return ids;
}
// Sort key: first in the high half, second in the low half.
inline std::uint64_t key_of(std::uint64_t ids) noexcept {
  return std::endian::native == std::endian::little ? std::rotl(ids, 32) : ids;
}
inline std::uint64_t key_of(const LivePair& p) noexcept { return key_of(ids_at(&p)); }
inline bool pair_less(const LivePair& a, const LivePair& b) noexcept {
  return key_of(a) < key_of(b);
}

}  // namespace throng::tracking
