// Compares boxes as bits: NaN payloads and signs of zeros count.
#pragma once

#include <cstring>
#include <vector>

#include <throng/throng.hpp>

namespace throng::tests {

// Compares two lists of trivial values.
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
