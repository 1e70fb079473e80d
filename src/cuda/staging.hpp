// Transfers between host arrays and a device through two pinned buffers: one is filled or emptied
// while the other is being copied.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstddef>

#include "cuda/check.hpp"

namespace throng::cuda {

class Staging {
 public:
  // A copy of this size takes about 10 us, less than one thread needs to fill it. An estimate.
  static constexpr std::size_t piece_bytes = std::size_t{512} << 10;
  static constexpr std::size_t total_bytes = 2 * piece_bytes;

  Staging() noexcept = default;
  ~Staging() {
    for (int k = 0; k < 2; ++k) {
      if (copied_[k]) (void)cudaEventSynchronize(copied_[k]);
      if (copied_[k]) (void)cudaEventDestroy(copied_[k]);
      if (pinned_[k]) (void)cudaFreeHost(pinned_[k]);
    }
  }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  std::size_t held() const noexcept {
    return (pinned_[0] ? piece_bytes : 0) + (pinned_[1] ? piece_bytes : 0);
  }

  // Copies value(i) to to[i]; all copies have been issued when this returns.
  template <class T, class F>
  void send(T* to, std::size_t count, cudaStream_t stream, const F& value) {
    constexpr std::size_t piece = piece_bytes / sizeof(T);
    for (std::size_t begin = 0; begin < count; begin += piece) {
      const std::size_t size = std::min(piece, count - begin);
      T* pinned = ready<T>();
      for (std::size_t i = 0; i < size; ++i) pinned[i] = value(begin + i);
      move(to + begin, pinned, size, cudaMemcpyHostToDevice, stream);
    }
  }
  // Calls take(values, n) for all pieces in turn, each in host memory until it returns. A false
  // stops and is returned.
  template <class T, class F>
  bool receive(const T* from, std::size_t count, cudaStream_t stream, const F& take) {
    constexpr std::size_t piece = piece_bytes / sizeof(T);
    const auto start = [&](std::size_t begin) {
      T* pinned = ready<T>();
      move(pinned, from + begin, std::min(piece, count - begin), cudaMemcpyDeviceToHost, stream);
      return pinned;
    };
    const T* next = count ? start(0) : nullptr;
    for (std::size_t begin = 0; begin < count; begin += piece) {
      const T* values = next;
      const cudaEvent_t moved = copied_[next_ ^ 1];
      if (begin + piece < count) next = start(begin + piece);
      check(cudaEventSynchronize(moved));
      if (!take(values, std::min(piece, count - begin))) return false;
    }
    return true;
  }

 private:
  // The next buffer, once its last copy has ended.
  template <class T>
  T* ready() {
    void*& p = pinned_[next_];
    if (!copied_[next_]) check(cudaEventCreateWithFlags(&copied_[next_], cudaEventDisableTiming));
    if (!p) check(cudaMallocHost(&p, piece_bytes));
    check(cudaEventSynchronize(copied_[next_]));
    return static_cast<T*>(p);
  }
  template <class T>
  void move(T* to, const T* from, std::size_t count, cudaMemcpyKind kind, cudaStream_t stream) {
    check(cudaMemcpyAsync(to, from, count * sizeof(T), kind, stream));
    check(cudaEventRecord(copied_[next_], stream));
    next_ ^= 1;
  }

  void* pinned_[2] = {};
  cudaEvent_t copied_[2] = {};
  int next_ = 0;
};

}  // namespace throng::cuda
