// Boxes of host memory, whatever their layout, on their way to a device: gathered into pinned
// memory a piece at a time, two pieces in flight, and packed there.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstring>

#include "cuda/check.hpp"

namespace throng::cuda {

class Upload {
 public:
  static constexpr std::size_t piece_bytes = std::size_t{4} << 20;

  Upload() noexcept = default;
  ~Upload() {
    for (int k = 0; k < 2; ++k) {
      if (pinned_[k]) (void)cudaFreeHost(pinned_[k]);
      if (sent_[k]) (void)cudaEventDestroy(sent_[k]);
    }
  }
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  // Device bytes that a set of boxes and its filters takes.
  static std::size_t bytes(const Boxes& boxes) noexcept {
    std::size_t sum = rounded(boxes.size() * sizeof(Box));
    const Filters& f = boxes.filters;
    for (const bool given : {bool(f.group), bool(f.mask), bool(f.owner), bool(f.world)})
      if (given) sum += rounded(boxes.size() * 4);
    return sum + (f.is_static ? rounded(boxes.size()) : 0);
  }

  // A view of the boxes as they will lie from `to` on, which moves past them. The host's arrays
  // have been read when this returns.
  Boxes send(const Boxes& boxes, char*& to, cudaStream_t stream) {
    const std::size_t n = boxes.size();
    auto* packed = reinterpret_cast<Box*>(take(to, n * sizeof(Box)));
    copy<Box>(reinterpret_cast<char*>(packed), n, stream, [&](std::size_t i) { return boxes[i]; });
    Boxes view(packed, n);
    const auto filter = [&](auto& column, const auto& from) {
      using T = std::decay_t<decltype(from[0])>;
      if (!from) return;
      char* at = take(to, n * sizeof(T));
      copy<T>(at, n, stream, [&](std::size_t i) { return from[i]; });
      column = {reinterpret_cast<const T*>(at), n, sizeof(T)};
    };
    filter(view.filters.group, boxes.filters.group);
    filter(view.filters.mask, boxes.filters.mask);
    filter(view.filters.owner, boxes.filters.owner);
    filter(view.filters.world, boxes.filters.world);
    filter(view.filters.is_static, boxes.filters.is_static);
    return view;
  }

 private:
  static std::size_t rounded(std::size_t bytes) noexcept { return (bytes + 255) / 256 * 256; }
  static char* take(char*& at, std::size_t bytes) noexcept {
    char* p = at;
    at += rounded(bytes);
    return p;
  }

  template <class T, class F>
  void copy(char* to, std::size_t count, cudaStream_t stream, F&& value) {
    constexpr std::size_t piece = piece_bytes / sizeof(T);
    for (std::size_t begin = 0; begin < count; begin += piece) {
      const std::size_t size = std::min(piece, count - begin);
      prepare(turn_);
      T* pinned = reinterpret_cast<T*>(pinned_[turn_]);
      for (std::size_t i = 0; i < size; ++i) pinned[i] = value(begin + i);
      check(cudaMemcpyAsync(to + begin * sizeof(T), pinned, size * sizeof(T),
                            cudaMemcpyHostToDevice, stream));
      check(cudaEventRecord(sent_[turn_], stream));
      turn_ ^= 1;
    }
  }
  // The piece's last copy is done.
  void prepare(int k) {
    if (!pinned_[k]) {
      void* p = nullptr;
      check(cudaMallocHost(&p, piece_bytes));
      pinned_[k] = static_cast<char*>(p);
      check(cudaEventCreateWithFlags(&sent_[k], cudaEventDisableTiming));
      return;
    }
    check(cudaEventSynchronize(sent_[k]));
  }

  char* pinned_[2] = {};
  cudaEvent_t sent_[2] = {};
  int turn_ = 0;
};

}  // namespace throng::cuda
