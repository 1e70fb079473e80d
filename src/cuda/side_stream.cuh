// A second stream, for launches that may run concurrently with those of the first.
#pragma once

#include "cuda/check.hpp"

namespace throng::cuda {

class SideStream {
 public:
  // Failure: no_device, out_of_memory.
  SideStream() {
    const cudaError_t made[] = {
        cudaStreamCreateWithFlags(&side_, cudaStreamNonBlocking),
        cudaEventCreateWithFlags(&forked_, cudaEventDisableTiming),
        cudaEventCreateWithFlags(&joined_, cudaEventDisableTiming),
    };
    for (const cudaError_t each : made) {
      if (each == cudaSuccess) continue;
      destroy();
      check(each);
    }
  }
  ~SideStream() { destroy(); }
  SideStream(const SideStream&) = delete;
  SideStream& operator=(const SideStream&) = delete;

  // Calls f with `stream` replaced by the side stream. f's launches follow the work already on
  // `stream` and may run concurrently with later work, until join().
  template <class F>
  void fork(cudaStream_t& stream, const F& f) {
    check(cudaEventRecord(forked_, stream));
    check(cudaStreamWaitEvent(side_, forked_));
    const RestoreStream back{stream, stream};
    stream = side_;
    f();
    check(cudaEventRecord(joined_, side_));
  }
  // Later work on `stream` follows the side stream's work.
  void join(cudaStream_t stream) const { check(cudaStreamWaitEvent(stream, joined_)); }

 private:
  struct RestoreStream {
    cudaStream_t& stream;
    cudaStream_t to;
    ~RestoreStream() { stream = to; }
  };
  void destroy() noexcept {
    if (forked_) (void)cudaEventDestroy(forked_);
    if (joined_) (void)cudaEventDestroy(joined_);
    if (side_) (void)cudaStreamDestroy(side_);
  }

  cudaStream_t side_ = nullptr;
  cudaEvent_t forked_ = nullptr, joined_ = nullptr;
};

}  // namespace throng::cuda
