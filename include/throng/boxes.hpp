// Boxes: a view of somebody's array of boxes, in whatever layout, and of the filters beside it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include <throng/types.hpp>

namespace throng {

// `count` values of T, `stride_bytes` apart. No data: absent.
template <class T>
struct Strided {
  const T* data = nullptr;
  std::size_t count = 0;
  std::size_t stride_bytes = sizeof(T);

  explicit operator bool() const noexcept { return data != nullptr; }
  const T& operator[](std::size_t i) const noexcept {
    return *reinterpret_cast<const T*>(reinterpret_cast<const char*>(data) + i * stride_bytes);
  }
};

// Which pairs are wanted. Each filter is optional and has one value a box; a pair is reported when
// every given filter allows it.
struct Filters {
  Strided<std::uint32_t> group;  // (group a & mask b) and (group b & mask a) must both be nonzero;
  Strided<std::uint32_t> mask;   // the absent one of the two counts as all ones
  Strided<std::int32_t> owner;   // equal owners never pair; -1 is nobody's
  Strided<std::int32_t> world;   // different worlds never pair; -1 meets every world; below: error
  Strided<std::uint8_t> is_static;  // two nonzero values never pair
};

// A view: it owns nothing, and what it shows must outlive it. Copying it is cheap.
// The stride of the coordinates is in bytes, a multiple of four; 0 repeats one box.
class Boxes {
 public:
  Boxes() noexcept = default;

  // `count` boxes, `stride_bytes` apart.
  Boxes(const Box* boxes, std::size_t count, std::size_t stride_bytes = sizeof(Box)) noexcept
      : count_(count) {
    const float* base = reinterpret_cast<const float*>(boxes);
    for (int k = 0; k < 6; ++k) corner_[k] = base ? base + k : nullptr;
    stride_bytes_ = stride_bytes;
    packed_ = true;
  }

  // Any container of Box with data() and size(): std::vector, std::array, std::span.
  template <
      class Container, class = decltype(std::declval<const Container&>().data()),
      class = std::enable_if_t<std::is_same<std::remove_cv_t<std::remove_pointer_t<
                                                decltype(std::declval<const Container&>().data())>>,
                                            Box>::value>>
  Boxes(const Container& boxes) noexcept  // NOLINT(google-explicit-constructor): a view
      : Boxes(boxes.data(), boxes.size()) {}

  // Lower and upper corners in two arrays.
  static Boxes split(const Vec3* lower, const Vec3* upper, std::size_t count,
                     std::size_t stride_bytes = sizeof(Vec3)) noexcept {
    const float* l = reinterpret_cast<const float*>(lower);
    const float* u = reinterpret_cast<const float*>(upper);
    return l && u ? arrays(l, l + 1, l + 2, u, u + 1, u + 2, count, stride_bytes)
                  : arrays(nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, count);
  }

  // One array a coordinate. Both z arrays null: the boxes are 2-D.
  static Boxes arrays(const float* lower_x, const float* lower_y, const float* lower_z,
                      const float* upper_x, const float* upper_y, const float* upper_z,
                      std::size_t count, std::size_t stride_bytes = sizeof(float)) noexcept {
    Boxes b;
    const float* corner[6] = {lower_x, lower_y, lower_z, upper_x, upper_y, upper_z};
    for (int k = 0; k < 6; ++k) b.corner_[k] = corner[k];
    b.count_ = count;
    b.stride_bytes_ = stride_bytes;
    return b;
  }

  std::size_t size() const noexcept { return count_; }
  bool empty() const noexcept { return count_ == 0; }

  // Coordinate k of box i: lower x, y, z, upper x, y, z. A missing z is 0.
  float corner(std::size_t i, int k) const noexcept {
    const float* p = corner_[k];
    if (!p) return 0.0f;
    return *reinterpret_cast<const float*>(reinterpret_cast<const char*>(p) + i * stride_bytes_);
  }
  Box operator[](std::size_t i) const noexcept {
    return {{corner(i, 0), corner(i, 1), corner(i, 2)}, {corner(i, 3), corner(i, 4), corner(i, 5)}};
  }

  // The first box where all six floats of a box lie together, else null; and the distance between.
  const char* packed_data() const noexcept {
    return packed_ ? reinterpret_cast<const char*>(corner_[0]) : nullptr;
  }
  // Coordinate k of the first box; null for a missing z. stride_bytes() on stands the next box's.
  const char* corner_data(int k) const noexcept {
    return reinterpret_cast<const char*>(corner_[k]);
  }
  std::size_t stride_bytes() const noexcept { return stride_bytes_; }
  bool is_flat() const noexcept { return count_ != 0 && !corner_[2]; }
  // False where a coordinate array that must be there is null.
  bool complete() const noexcept {
    return count_ == 0 || (corner_[0] && corner_[1] && corner_[3] && corner_[4] &&
                           (corner_[2] != nullptr) == (corner_[5] != nullptr));
  }

  Filters filters;

 private:
  const float* corner_[6] = {};
  std::size_t stride_bytes_ = 0;
  std::size_t count_ = 0;
  bool packed_ = false;
};

}  // namespace throng
