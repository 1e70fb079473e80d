// Boxes compared as bits: NaN's payload and the sign of zero count.
#pragma once

#include <cstring>
#include <vector>

#include <throng/throng.hpp>

namespace throng::tests {

// Two lists of plain values, of whatever kind.
template <class List>
bool same_bytes(const List& a, const List& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}

inline bool same_bits(const Box& a, const Box& b) { return std::memcmp(&a, &b, sizeof(Box)) == 0; }
inline bool same_bits(const std::vector<Box>& a, const std::vector<Box>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Box)) == 0);
}

}  // namespace throng::tests
