// Backend::automatic for boxes in host memory: when a GPU is tried, and what is said when it fails.
#pragma once

#include <cstddef>
#include <utility>

#include <throng/options.hpp>

#include "cpu/threads.hpp"

namespace throng {

// For boxes in host memory one thread gathers 24 bytes a box and scatters the pairs again. Measured
// on an H200 beside 16 processors (bench/results/h200/host-arrays-2026-11-27.csv): ahead of four
// threads from 50,000 boxes on, of six up to 500,000. A smaller GPU pays later, and what it takes
// to wake one is made up for after some hundred frames: so not from the first box on that pays.
constexpr std::size_t gpu_pays_from = 200000;
constexpr unsigned gpu_pays_up_to_threads = 4;

// A Finder's choice. The first large call never takes a GPU: to wake one costs more than a search.
class Automatic {
 public:
  // Whether this call is to try one. A caller who gives an executor or memory is promised that
  // nothing is started or taken beside these, one who names an instruction set wants the CPU.
  bool wants_gpu(std::size_t boxes, const Options& options) noexcept {
    if (options.backend != Backend::automatic || options.executor || options.memory ||
        options.isa != Isa::automatic || boxes < gpu_pays_from || reason_) {
      return false;
    }
    return cpu::threads_of(options) <= gpu_pays_up_to_threads && std::exchange(seen_one_, true);
  }

  // Whether the CPU is to answer instead; then this Finder stays with it.
  bool falls_back(const Result& r) noexcept {
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
  // Why the CPU answers though so many boxes are a GPU's; null: they are not, or none was tried.
  const char* reason(std::size_t boxes) const noexcept {
    return boxes < gpu_pays_from ? nullptr : reason_;
  }

 private:
  bool seen_one_ = false;
  const char* reason_ = nullptr;
};

}  // namespace throng
