// Checks before a launch: the stream's device, and where the caller's arrays lie.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "base/strided_array.hpp"
#include "cuda/check.hpp"
#include "device/input.hpp"

namespace throng::cuda {

// Makes a device current for the lifetime of this object.
class CurrentDevice {
 public:
  explicit CurrentDevice(int device) : device_(device) {
    check(cudaGetDevice(&before_));
    if (before_ != device) check(cudaSetDevice(device));
  }
  ~CurrentDevice() {
    if (before_ != device_) (void)cudaSetDevice(before_);
  }
  CurrentDevice(const CurrentDevice&) = delete;
  CurrentDevice& operator=(const CurrentDevice&) = delete;

 private:
  int device_, before_ = 0;
};

// The device of a stream. The default stream belongs to the current device. A stream in capture
// cannot be queried and counts as the current device's; a launch on another device's stream fails
// by itself.
inline int device_of(cudaStream_t stream) {
  int device = 0;
  cudaStreamCaptureStatus recording = cudaStreamCaptureStatusNone;
  if (stream) check(cudaStreamIsCapturing(stream, &recording));
  const bool is_queryable = stream && recording == cudaStreamCaptureStatusNone;
  check(is_queryable ? cudaStreamGetDevice(stream, &device) : cudaGetDevice(&device));
  return device;
}

// Refuses arrays that the device cannot access: an invalid access would corrupt the process's CUDA
// context. Managed and pinned host memory are accepted.
class AccessCheck {
 public:
  AccessCheck(int device, Status status) noexcept : device_(device), status_(status) {}

  void require(const void* p, std::size_t alignment, const char* what) const {
    if (!p) refuse(what, "is null");
    cudaPointerAttributes attributes{};
    check(cudaPointerGetAttributes(&attributes, p));
    if (attributes.type == cudaMemoryTypeUnregistered) refuse(what, "lies in host memory");
    if (attributes.type == cudaMemoryTypeDevice && attributes.device != device_)
      refuse(what, "lies on another device");
    if (reinterpret_cast<std::uintptr_t>(p) % alignment != 0) refuse(what, "is not aligned");
  }
  // An optional array.
  template <class T>
  void require(const base::StridedArray<T>& column, const char* what) const {
    if (column) require(column.data, alignof(T), what);
  }

 private:
  [[noreturn]] void refuse(const char* what, const char* text) const {
    throw device::Failure{status_, 0, text, what};
  }
  int device_;
  Status status_;
};

inline void require_filters(const device::Set& set, int device) {
  const AccessCheck filters(device, Status::bad_filter);
  filters.require(set.group, "filter 'group'");
  filters.require(set.mask, "filter 'mask'");
  filters.require(set.owner, "filter 'owner'");
  filters.require(set.world, "filter 'world'");
  filters.require(set.is_static, "filter 'static'");
}
inline void require_set(const device::Set& set, std::size_t count, int device) {
  if (count == 0) return;
  const AccessCheck boxes(device, Status::bad_boxes);
  for (int k = 0; k < 6; ++k) {
    const char* p = set.corner[k];
    const bool packed = p == set.corner[0] + k * sizeof(float);  // already checked
    if (p && (k == 0 || !packed)) boxes.require(p, alignof(float), "a coordinate array");
  }
  require_filters(set, device);
}

}  // namespace throng::cuda
