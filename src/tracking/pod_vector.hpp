// A growing array of trivially copyable values. Allocation is separate from modification: reserve()
// keeps the contents when it throws, and nothing else but append() can fail.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include "base/memory.hpp"

namespace throng::tracking {

template <class T>
class PodVector {
 public:
  static_assert(std::is_trivially_copyable_v<T>);
  explicit PodVector(base::Memory& memory) noexcept : buffer_(memory) {}

  void reserve(std::size_t count) { buffer_.grow(count, size_); }
  // Makes the capacity at least `count`; discards the contents.
  void reserve_discard(std::size_t count) {
    size_ = 0;
    buffer_.ensure(count, true);
  }
  // Makes the capacity at least that of another; discards the contents if it grows.
  void match(const PodVector& other) {
    if (other.capacity() > capacity()) reserve_discard(other.capacity());
  }
  void append(const T& value) {
    if (size_ == buffer_.capacity()) reserve(size_ + 64);
    buffer_[size_++] = value;
  }

  // Capacity must suffice.
  void push(const T& value) noexcept { buffer_[size_++] = value; }
  void push(const PodVector& other) noexcept {
    if (other.size_ != 0) std::memcpy(data() + size_, other.data(), other.size_ * sizeof(T));
    size_ += other.size_;
  }
  void resize(std::size_t count) noexcept { size_ = count; }
  void copy(const PodVector& other) noexcept {
    size_ = other.size_;
    if (size_ != 0) std::memcpy(data(), other.data(), size_ * sizeof(T));
  }

  T pop() noexcept { return buffer_[--size_]; }
  void clear() noexcept { size_ = 0; }
  void swap(PodVector& other) noexcept {
    buffer_.swap(other.buffer_);
    std::swap(size_, other.size_);
  }
  T* data() const noexcept { return buffer_.data(); }
  T& operator[](std::size_t i) const noexcept { return buffer_[i]; }
  T* begin() const noexcept { return data(); }
  T* end() const noexcept { return data() + size_; }
  std::size_t size() const noexcept { return size_; }
  std::size_t capacity() const noexcept { return buffer_.capacity(); }
  bool empty() const noexcept { return size_ == 0; }

 private:
  base::Buffer<T> buffer_;
  std::size_t size_ = 0;
};

}  // namespace throng::tracking
