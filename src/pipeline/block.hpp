// A block of a device's memory that keeps its room.
#pragma once

#include <cstddef>
#include <utility>

namespace throng::pipeline {

template <class Device>
class Block {
 public:
  explicit Block(Device& device) noexcept : device_(device) {}
  ~Block() { release(); }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  // What it holds is lost when it grows.
  char* room(std::size_t bytes) {
    if (bytes > bytes_) {
      release();
      data_ = static_cast<char*>(device_.allocate(bytes));
      bytes_ = bytes;
    }
    return data_;
  }
  // Keeps the first `kept` bytes, and grows by more than is asked for, so that it seldom must. A
  // Failure changes nothing.
  void grow(std::size_t bytes, std::size_t kept) {
    if (bytes <= bytes_) return;
    Block fresh(device_);
    fresh.room(bytes + bytes / 4);
    if (kept) device_.copy(fresh.data_, data_, kept);
    swap(fresh);
  }
  // Of blocks of one device.
  void swap(Block& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }
  // Gives it all back where it is more than so many bytes.
  void trim(std::size_t bytes) noexcept {
    if (bytes_ > bytes) release();
  }
  void release() noexcept {
    if (data_) device_.release(data_, bytes_);
    data_ = nullptr;
    bytes_ = 0;
  }
  template <class T>
  T* as() const noexcept {
    return reinterpret_cast<T*>(data_);
  }
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  Device& device_;
  char* data_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace throng::pipeline
