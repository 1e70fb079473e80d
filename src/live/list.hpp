// A growing array of trivially copyable values. Allocation is separate from modification: reserve()
// keeps the contents when it throws, and nothing else but append() can fail.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include "cpu/memory.hpp"

namespace throng::live {

template <class T>
class List {
 public:
  static_assert(std::is_trivially_copyable_v<T>);
  explicit List(cpu::Memory& memory) noexcept : room_(memory) {}

  void reserve(std::size_t count) { room_.grow(count, size_); }
  // Makes the capacity at least `count`; discards the contents.
  void renew(std::size_t count) {
    size_ = 0;
    room_.room(count, true);
  }
  // Makes the capacity at least that of another; discards the contents if it grows.
  void match(const List& other) {
    if (other.capacity() > capacity()) renew(other.capacity());
  }
  void append(const T& value) {
    if (size_ == room_.capacity()) reserve(size_ + 64);
    room_[size_++] = value;
  }

  // Capacity must suffice.
  void push(const T& value) noexcept { room_[size_++] = value; }
  void push(const List& other) noexcept {
    if (other.size_ != 0) std::memcpy(data() + size_, other.data(), other.size_ * sizeof(T));
    size_ += other.size_;
  }
  void resize(std::size_t count) noexcept { size_ = count; }
  void copy(const List& other) noexcept {
    size_ = other.size_;
    if (size_ != 0) std::memcpy(data(), other.data(), size_ * sizeof(T));
  }

  T pop() noexcept { return room_[--size_]; }
  void clear() noexcept { size_ = 0; }
  void swap(List& other) noexcept {
    room_.swap(other.room_);
    std::swap(size_, other.size_);
  }
  T* data() const noexcept { return room_.data(); }
  T& operator[](std::size_t i) const noexcept { return room_[i]; }
  T* begin() const noexcept { return data(); }
  T* end() const noexcept { return data() + size_; }
  std::size_t size() const noexcept { return size_; }
  std::size_t capacity() const noexcept { return room_.capacity(); }
  bool empty() const noexcept { return size_ == 0; }

 private:
  cpu::Buffer<T> room_;
  std::size_t size_ = 0;
};

}  // namespace throng::live
