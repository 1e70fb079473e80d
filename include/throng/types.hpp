// Plain data of the broad phase: points, boxes, pairs.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

namespace throng {

struct Vec3 {
  float x, y, z;
};

// An axis-aligned box, closed on every side: a point on a face belongs to it. World units.
struct Box {
  Vec3 lower, upper;
};

// The same in doubles, for pairs that floats cannot tell: see DoubleBoxes.
struct DoubleVec3 {
  double x, y, z;
};
struct DoubleBox {
  DoubleVec3 lower, upper;
};

// Indices of two overlapping boxes. Of one set first < second; of two sets first indexes the first
// set and second the second.
struct Pair {
  std::uint32_t first, second;
};

constexpr bool operator==(Pair a, Pair b) noexcept {
  return a.first == b.first && a.second == b.second;
}
constexpr bool operator!=(Pair a, Pair b) noexcept { return !(a == b); }
// The canonical order: by first, then by second.
constexpr bool operator<(Pair a, Pair b) noexcept {
  return a.first != b.first ? a.first < b.first : a.second < b.second;
}

// The same across MPI ranks, by ids that the caller gave.
struct Pair64 {
  std::uint64_t first, second;
};

constexpr bool operator==(Pair64 a, Pair64 b) noexcept {
  return a.first == b.first && a.second == b.second;
}
constexpr bool operator!=(Pair64 a, Pair64 b) noexcept { return !(a == b); }
constexpr bool operator<(Pair64 a, Pair64 b) noexcept {
  return a.first != b.first ? a.first < b.first : a.second < b.second;
}

// The largest number of boxes in one set, 2^32 - 2^16. Indices are 32 bits wide; what is left above
// them is for marks that are no index, and so that a count and the little that is read or written
// beyond an array has a number of 32 bits, too.
constexpr std::uint64_t max_box_count = 0xffff0000ull;

}  // namespace throng
