// A row: a box, its index in its file, and the given filters, interleaved. The library accepts
// strides, so rows are searched in place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include <throng/boxes.hpp>

namespace throng::stream {

// The byte offset of each part of a row; absent filters have none.
struct Layout {
  static constexpr std::size_t index_at = sizeof(Box);
  static constexpr std::size_t max_bytes = sizeof(Box) + 6 * 4;

  std::size_t bytes = sizeof(Box) + 4;
  std::size_t group = 0, mask = 0, owner = 0, world = 0, is_static = 0;

  void add(std::size_t& filter) noexcept {
    filter = bytes;
    bytes += 4;  // for a flag, too: strides are multiples of four
  }
};

// `count` rows in memory.
struct Rows {
  char* data = nullptr;
  std::size_t count = 0;
  const Layout* layout = nullptr;

  char* row(std::size_t i) const noexcept { return data + i * layout->bytes; }
  Box box(std::size_t i) const noexcept { return box_of(row(i)); }
  std::uint32_t index(std::size_t i) const noexcept {
    std::uint32_t index;
    std::memcpy(&index, row(i) + Layout::index_at, sizeof index);
    return index;
  }
  Rows part(std::size_t begin, std::size_t how_many) const noexcept {
    return {row(begin), how_many, layout};
  }
  void swap(std::size_t i, std::size_t j) const noexcept {
    char kept[Layout::max_bytes];
    std::memcpy(kept, row(i), layout->bytes);
    std::memmove(row(i), row(j), layout->bytes);
    std::memcpy(row(j), kept, layout->bytes);
  }

  Boxes view() const noexcept {
    Boxes boxes(reinterpret_cast<const Box*>(data), count, layout->bytes);
    column(layout->group, boxes.filters.group);
    column(layout->mask, boxes.filters.mask);
    column(layout->owner, boxes.filters.owner);
    column(layout->world, boxes.filters.world);
    column(layout->is_static, boxes.filters.is_static);
    return boxes;
  }

  static Box box_of(const char* row) noexcept {
    Box box;
    std::memcpy(&box, row, sizeof box);
    return box;
  }

 private:
  template <class T>
  void column(std::size_t at, Strided<T>& to) const noexcept {
    if (at != 0) to = {reinterpret_cast<const T*>(data + at), count, layout->bytes};
  }
};

// A source of rows.
class Source {
 public:
  virtual ~Source() = default;
  virtual std::uint64_t count() const noexcept = 0;
  virtual void read(std::uint64_t first, std::size_t count, char* out) = 0;
};

inline float lower(const Box& b, int axis) noexcept {
  return axis == 0 ? b.lower.x : axis == 1 ? b.lower.y : b.lower.z;
}
inline float upper(const Box& b, int axis) noexcept {
  return axis == 0 ? b.upper.x : axis == 1 ? b.upper.y : b.upper.z;
}
// False for an empty slot and for a NaN.
inline bool is_active(const Box& b) noexcept {
  return b.lower.x <= b.upper.x && b.lower.y <= b.upper.y && b.lower.z <= b.upper.z;
}
inline bool has_nan(const Box& b) noexcept {
  return b.lower.x != b.lower.x || b.lower.y != b.lower.y || b.lower.z != b.lower.z ||
         b.upper.x != b.upper.x || b.upper.y != b.upper.y || b.upper.z != b.upper.z;
}

}  // namespace throng::stream
