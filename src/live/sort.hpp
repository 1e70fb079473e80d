// A radix sort of pairs with their slots.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/broad_phase.hpp>

namespace throng::live {

// By first, then second; ids are below `limit`. `spare` has room for as many.
void sort_pairs(LivePair* pairs, LivePair* spare, std::size_t count, std::size_t limit) noexcept;

inline std::uint64_t key_of(const LivePair& p) noexcept {
  return std::uint64_t{p.first} << 32 | p.second;
}

}  // namespace throng::live
