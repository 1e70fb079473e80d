// Boxes: a non-owning view of an array of boxes in any strided layout, with optional filters.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include <throng/types.hpp>

namespace throng {

// `count` values of T, `stride_bytes` apart. A null `data` means absent.
template <class T>
struct Strided {
  const T* data = nullptr;
  std::size_t count = 0;
  std::size_t stride_bytes = sizeof(T);

  Strided() noexcept = default;
  Strided(const T* values, std::size_t value_count, std::size_t stride = sizeof(T)) noexcept
      : data(values), count(value_count), stride_bytes(stride) {}
  // Any container of T with data() and size(): std::vector, std::array, std::span.
  template <class Container,
            class = std::enable_if_t<
                std::is_same<std::remove_cv_t<std::remove_pointer_t<
                                 decltype(std::declval<const Container&>().data())>>,
                             T>::value &&
                std::is_convertible<decltype(std::declval<const Container&>().size()),
                                    std::size_t>::value>>
  Strided(const Container& values) noexcept  // NOLINT(google-explicit-constructor): a view
      : Strided(values.data(), values.size()) {}

  explicit operator bool() const noexcept { return data != nullptr; }
  const T& operator[](std::size_t i) const noexcept {
    return *reinterpret_cast<const T*>(reinterpret_cast<const char*>(data) + i * stride_bytes);
  }
};

// Which pairs are reported. Each filter is optional and has one value per box. A pair is reported
// when every given filter allows it.
struct Filters {
  Strided<std::uint32_t> group;  // (group a & mask b) and (group b & mask a) must both be nonzero;
  Strided<std::uint32_t> mask;   // if only one of the two is given, the other counts as all ones
  Strided<std::int32_t> owner;   // equal owners never pair; -1: no owner
  Strided<std::int32_t> world;   // different worlds (environments) never pair; -1 pairs with every
                                 // world; below -1: error
  Strided<std::uint8_t> is_static;  // two nonzero values never pair
};

// A non-owning view: the arrays must outlive it. Cheap to copy.
// `stride_bytes` is the distance between boxes in bytes, a multiple of sizeof(Real); 0 repeats one
// box.
template <class Real>
class BasicBoxes {
  static_assert(std::is_same<Real, float>::value || std::is_same<Real, double>::value,
                "boxes are of floats or of doubles");

 public:
  static constexpr bool is_float = std::is_same<Real, float>::value;
  using Corner = std::conditional_t<is_float, Vec3, DoubleVec3>;
  using Value = std::conditional_t<is_float, Box, DoubleBox>;

  BasicBoxes() noexcept = default;

  // `count` boxes, `stride_bytes` apart.
  BasicBoxes(const Value* boxes, std::size_t count,
             std::size_t stride_bytes = sizeof(Value)) noexcept
      : count_(count) {
    const Real* base = reinterpret_cast<const Real*>(boxes);
    for (int k = 0; k < 6; ++k) corner_[k] = base ? base + k : nullptr;
    stride_bytes_ = stride_bytes;
    packed_ = true;
  }

  // Any container of boxes with data() and size(): std::vector, std::array, std::span.
  template <
      class Container, class = decltype(std::declval<const Container&>().data()),
      class = std::enable_if_t<std::is_same<std::remove_cv_t<std::remove_pointer_t<
                                                decltype(std::declval<const Container&>().data())>>,
                                            Value>::value>>
  BasicBoxes(const Container& boxes) noexcept  // NOLINT(google-explicit-constructor): a view
      : BasicBoxes(boxes.data(), boxes.size()) {}

  // Lower and upper corners in two arrays, `stride_bytes` apart.
  static BasicBoxes split(const Corner* lower, const Corner* upper, std::size_t count,
                          std::size_t stride_bytes = sizeof(Corner)) noexcept {
    const Real* l = reinterpret_cast<const Real*>(lower);
    const Real* u = reinterpret_cast<const Real*>(upper);
    return l && u ? arrays(l, l + 1, l + 2, u, u + 1, u + 2, count, stride_bytes)
                  : arrays(nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, count);
  }

  // One array per coordinate. Both z arrays null: the boxes are 2-D.
  static BasicBoxes arrays(const Real* lower_x, const Real* lower_y, const Real* lower_z,
                           const Real* upper_x, const Real* upper_y, const Real* upper_z,
                           std::size_t count, std::size_t stride_bytes = sizeof(Real)) noexcept {
    BasicBoxes b;
    const Real* corner[6] = {lower_x, lower_y, lower_z, upper_x, upper_y, upper_z};
    for (int k = 0; k < 6; ++k) b.corner_[k] = corner[k];
    b.count_ = count;
    b.stride_bytes_ = stride_bytes;
    return b;
  }

  std::size_t size() const noexcept { return count_; }
  bool empty() const noexcept { return count_ == 0; }

  // Coordinate k of box i, in the order lower x, y, z, upper x, y, z. A missing z is 0.
  Real corner(std::size_t i, int k) const noexcept {
    const Real* p = corner_[k];
    if (!p) return 0;
    return *reinterpret_cast<const Real*>(reinterpret_cast<const char*>(p) + i * stride_bytes_);
  }
  Value operator[](std::size_t i) const noexcept {
    return {{corner(i, 0), corner(i, 1), corner(i, 2)}, {corner(i, 3), corner(i, 4), corner(i, 5)}};
  }

  // The address of the first box if the six numbers of each box are contiguous, else null.
  const char* packed_data() const noexcept {
    return packed_ ? reinterpret_cast<const char*>(corner_[0]) : nullptr;
  }
  // The address of coordinate k of the first box; null for a missing z. The value of box i lies i *
  // stride_bytes() further on.
  const char* corner_data(int k) const noexcept {
    return reinterpret_cast<const char*>(corner_[k]);
  }
  std::size_t stride_bytes() const noexcept { return stride_bytes_; }
  bool is_flat() const noexcept { return count_ != 0 && !corner_[2]; }
  // False if a required coordinate array is null.
  bool complete() const noexcept {
    return count_ == 0 || (corner_[0] && corner_[1] && corner_[3] && corner_[4] &&
                           (corner_[2] != nullptr) == (corner_[5] != nullptr));
  }

  Filters filters;

 private:
  const Real* corner_[6] = {};
  std::size_t stride_bytes_ = 0;
  std::size_t count_ = 0;
  bool packed_ = false;
};

using Boxes = BasicBoxes<float>;

// Boxes of doubles. Finder and find_pairs compare them exactly as doubles, on the CPU only. A box
// is DoubleBox, a corner DoubleVec3.
using DoubleBoxes = BasicBoxes<double>;

}  // namespace throng
