// A caller's strided array as plain pointers, readable by host and device threads.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/boxes.hpp>

#include "base/host_device_macros.hpp"

namespace throng::base {

// Values `stride` bytes apart. data == nullptr: the array is absent. Not the public Strided: device
// code calls only functions that are marked for it, which those of a standard C++ header cannot be;
// and without the count a kernel's argument is a third smaller.
template <class T>
struct StridedArray {
  const char* data = nullptr;
  std::size_t stride = sizeof(T);

  THRONG_HD explicit operator bool() const noexcept { return data != nullptr; }
  THRONG_HD const T& operator[](std::size_t i) const noexcept {
    return *reinterpret_cast<const T*>(data + i * stride);
  }
};

template <class T>
StridedArray<T> strided_array(const Strided<T>& array) noexcept {
  return {reinterpret_cast<const char*>(array.data), array.stride_bytes};
}

}  // namespace throng::base
