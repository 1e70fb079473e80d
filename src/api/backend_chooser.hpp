// Backend::automatic for boxes in host memory: when to try a GPU, and what to report if it fails.
#pragma once

#include <cstddef>
#include <utility>

#include <throng/options.hpp>

#include "base/threads.hpp"

namespace throng {

// For boxes in host memory one thread gathers 24 bytes per box and scatters the pairs. Measured on
// an H200 with 16 CPU cores (bench/results/h200/host-arrays-2026-11-27.csv): faster than four
// threads from 50,000 boxes on, than six up to 500,000. The threshold is higher, since a smaller
// GPU breaks even later, and initializing a GPU costs as much as some hundred frames save.
constexpr std::size_t min_gpu_boxes = 200000;
constexpr unsigned max_cpu_threads = 4;

// The choice of one Finder. The first large call never takes a GPU: initializing it costs more than
// a search.
class BackendChooser {
 public:
  // Whether this call tries a GPU. Not if the caller gives an executor or memory resource (no other
  // threads or memory may be used then) or names an instruction set (of the CPU).
  bool should_try_gpu(std::size_t boxes, const Options& options) noexcept {
    if (options.backend != Backend::automatic || options.executor || options.memory ||
        options.isa != Isa::automatic || boxes < min_gpu_boxes || reason_) {
      return false;
    }
    return base::threads_of(options) <= max_cpu_threads && std::exchange(saw_large_call_, true);
  }

  // Whether the CPU repeats this call; from then on this Finder stays on the CPU.
  bool should_fall_back(const Result& r) noexcept {
    switch (r.status) {
      case Status::no_device:
        reason_ = "on the CPU: no GPU can be used, cuda::available() says why";
        return true;
      case Status::out_of_memory:
      case Status::memory_cap_too_small:
        reason_ = "on the CPU: too little memory for a GPU's search";
        return true;
      case Status::device_error:
        reason_ = "on the CPU: the GPU failed";
        return true;
      case Status::too_many_boxes:
        reason_ = "on the CPU: more boxes than a GPU takes";
        return true;
      default:
        return false;
    }
  }
  // Why the CPU handles so many boxes; null: too few boxes, or no GPU was tried.
  const char* reason(std::size_t boxes) const noexcept {
    return boxes < min_gpu_boxes ? nullptr : reason_;
  }

 private:
  bool saw_large_call_ = false;
  const char* reason_ = nullptr;
};

}  // namespace throng
