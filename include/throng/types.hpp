// Plain data types: points, boxes, pairs.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

namespace throng {

struct Vec3 {
  float x, y, z;
};

// An axis-aligned box in world units. Closed: a point on a face belongs to it, so touching boxes
// overlap.
struct Box {
  Vec3 lower, upper;
};

// The double-precision forms, for DoubleBoxes.
struct DoubleVec3 {
  double x, y, z;
};
struct DoubleBox {
  DoubleVec3 lower, upper;
};

// Indices of two overlapping boxes. One set: first < second. Two sets: first indexes the first set,
// second the second set.
struct Pair {
  std::uint32_t first, second;
};

constexpr bool operator==(Pair a, Pair b) noexcept {
  return a.first == b.first && a.second == b.second;
}
constexpr bool operator!=(Pair a, Pair b) noexcept { return !(a == b); }
// The sorted order of Order::canonical: by first, then by second.
constexpr bool operator<(Pair a, Pair b) noexcept {
  return a.first != b.first ? a.first < b.first : a.second < b.second;
}

// A pair across MPI ranks, as 64-bit ids that the caller assigns.
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

// A view of results: `size()` values of T in the memory of the object that found them.
template <class T>
struct ArrayView {
  const T* data_ = nullptr;
  std::size_t size_ = 0;

  const T* data() const noexcept { return data_; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  const T* begin() const noexcept { return data_; }
  const T* end() const noexcept { return data_ + size_; }
  const T& operator[](std::size_t i) const noexcept { return data_[i]; }
};

// The largest number of boxes in one set, 2^32 - 2^16. The indices above it serve as sentinels, and
// keep counts and the reads past an array's end within 32 bits.
constexpr std::uint64_t max_box_count = 0xffff0000ull;

}  // namespace throng
