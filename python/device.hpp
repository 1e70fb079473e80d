// Searches where the boxes lie on a GPU: what is found stays there.
#pragma once

#include <memory>

#include <nanobind/nanobind.h>

#include <throng/options.hpp>

#include "python/arrays.hpp"

namespace throng::python {

// Whether this build can search there at all.
bool gpu_is_built() noexcept;

// A Finder of a GPU's: that of the first call.
class DeviceFinder {
 public:
  DeviceFinder(const Options& options, int device);
  ~DeviceFinder();
  DeviceFinder(const DeviceFinder&) = delete;
  DeviceFinder& operator=(const DeviceFinder&) = delete;

  int device() const noexcept { return device_; }
  std::size_t memory_bytes() const noexcept;

  // (m, 2) uint32: on that device, for whoever speaks DLPack, or `to_host`, of NumPy. `b` may be
  // null. The pairs are there when it returns, for any stream. What was told goes to `result`.
  nb::object find(const BoxArray& a, const BoxArray* b, std::uintptr_t stream, bool to_host,
                  Result& result);
  // Whether boxes with lower > upper are among these, by a copy of them on the host.
  Result check(const BoxArray& a, const BoxArray* b) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  int device_;
};

}  // namespace throng::python
