// A block of device memory that keeps its capacity.
#pragma once

#include <cstddef>
#include <utility>

namespace throng::device {

template <class Device>
class DeviceBuffer {
 public:
  explicit DeviceBuffer(Device& device) noexcept : device_(device) {}
  ~DeviceBuffer() { release(); }
  DeviceBuffer(const DeviceBuffer&) = delete;
  DeviceBuffer& operator=(const DeviceBuffer&) = delete;

  // Ensures the capacity. The contents are lost when it grows.
  char* ensure(std::size_t bytes) {
    if (bytes > bytes_) {
      release();
      data_ = static_cast<char*>(device_.allocate(bytes));
      bytes_ = bytes;
    }
    return data_;
  }
  // Ensures the capacity and keeps the first `kept` bytes. Over-allocates by 25 %, so that it grows
  // seldom. On a Failure nothing changes.
  void grow(std::size_t bytes, std::size_t kept) {
    if (bytes <= bytes_) return;
    DeviceBuffer fresh(device_);
    fresh.ensure(bytes + bytes / 4);
    if (kept) device_.copy(fresh.data_, data_, kept);
    swap(fresh);
  }
  // Both blocks belong to one device.
  void swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }
  // Releases the block if it has more than `bytes`.
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

}  // namespace throng::device
