// Searches of boxes on a GPU; the pairs stay there.
#pragma once

#include <memory>

#include <nanobind/nanobind.h>

#include <throng/options.hpp>

#include "python/arrays.hpp"

namespace throng::python {

// Whether this build supports it.
bool gpu_is_built() noexcept;

// A Finder of the GPU of the first call.
class DeviceFinder {
 public:
  DeviceFinder(const Options& options, int device);
  ~DeviceFinder();
  DeviceFinder(const DeviceFinder&) = delete;
  DeviceFinder& operator=(const DeviceFinder&) = delete;

  int device() const noexcept { return device_; }
  std::size_t memory_bytes() const noexcept;

  // (m, 2) uint32: on that device, with DLPack, or as NumPy with `to_host`. `b` may be null. The
  // pairs are complete on return, for any stream. The counts go to `result`.
  nb::object find(const BoxArray& a, const BoxArray* b, std::uintptr_t stream, bool to_host,
                  Result& result);
  // Whether any of these boxes has lower > upper, by a copy on the host.
  Result check(const BoxArray& a, const BoxArray* b) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  int device_;
};

}  // namespace throng::python
