// Memory that vector kernels access beyond its end.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/memory.hpp"

namespace throng::base {

// An array, after whose elements `padding` more of any value may be read; where T is not const,
// written, too. Kernels read and write whole vectors, of which the last may go beyond the end. The
// number of elements is the owner's: several arrays often share one.
template <class T, std::uint32_t padding>
class PaddedArray {
 public:
  PaddedArray() = default;
  // Of `count` elements in a buffer, which grows as needed; what it held is lost.
  PaddedArray(Buffer<T>& buffer, std::size_t count) : PaddedArray(buffer.ensure(count + padding)) {}
  // Of an array with at least `count` + `padding` elements, or of null.
  static PaddedArray of(T* array) noexcept { return PaddedArray(array); }

  // Row `index` of equal rows in one buffer, which has row_elements(count) elements for each.
  static constexpr std::size_t row_elements(std::size_t count) noexcept {
    return (count + padding + 63) / 64 * 64;
  }
  static PaddedArray row(T* buffer, std::size_t index, std::size_t count) noexcept {
    return PaddedArray(buffer + index * row_elements(count));
  }
  // The elements from `begin` on.
  template <std::uint32_t less_padding>
  PaddedArray<const T, less_padding> from(std::size_t begin) const noexcept {
    static_assert(less_padding <= padding);
    return PaddedArray<const T, less_padding>::of(data_ + begin);
  }

  T* data() const noexcept { return data_; }
  explicit operator bool() const noexcept { return data_ != nullptr; }
  T& operator[](std::size_t i) const noexcept { return data_[i]; }

 private:
  explicit PaddedArray(T* data) noexcept : data_(data) {}

  T* data_ = nullptr;
};

}  // namespace throng::base
