// Device memory, streams, events and graphs of the GPU benchmark. Every CUDA call is checked; an
// error is thrown as std::runtime_error with CUDA's message.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include <throng/types.hpp>

#include "bench/require.hpp"

namespace throng::bench::gpu {

using bench::require;

inline void need(cudaError_t error) {
  if (error == cudaSuccess) return;
  (void)cudaGetLastError();
  throw std::runtime_error(std::string("CUDA: ") + cudaGetErrorString(error));
}

template <class T>
class DeviceArray {
 public:
  DeviceArray() = default;
  explicit DeviceArray(std::size_t size) : size_(size) {
    if (size) need(cudaMalloc(reinterpret_cast<void**>(&data_), size * sizeof(T)));
  }
  ~DeviceArray() { (void)cudaFree(data_); }
  DeviceArray(DeviceArray&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  DeviceArray& operator=(DeviceArray&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  void put(const T* from, std::size_t count, std::size_t at = 0) {
    need(cudaMemcpy(data_ + at, from, count * sizeof(T), cudaMemcpyHostToDevice));
    // The copy from pageable memory may be incomplete, and our streams do not wait for it.
    need(cudaDeviceSynchronize());
  }
  void get(T* to, std::size_t count) const {
    need(cudaMemcpy(to, data_, count * sizeof(T), cudaMemcpyDeviceToHost));
  }
  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

class OwnStream {
 public:
  OwnStream() { need(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~OwnStream() { (void)cudaStreamDestroy(stream_); }
  OwnStream(const OwnStream&) = delete;
  OwnStream& operator=(const OwnStream&) = delete;
  cudaStream_t get() const { return stream_; }
  void wait() const { need(cudaStreamSynchronize(stream_)); }

 private:
  cudaStream_t stream_ = nullptr;
};

class Event {
 public:
  Event() { need(cudaEventCreate(&event_)); }
  ~Event() { (void)cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  void record(cudaStream_t stream) const { need(cudaEventRecord(event_, stream)); }
  void wait() const { need(cudaEventSynchronize(event_)); }
  double ms_since(const Event& start) const {
    float ms = 0;
    need(cudaEventElapsedTime(&ms, start.event_, event_));
    return static_cast<double>(ms);
  }

 private:
  cudaEvent_t event_ = nullptr;
};

// The work that `put` adds to the stream, recorded once.
class Graph {
 public:
  template <class F>
  Graph(cudaStream_t stream, const F& put) {
    need(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    put();
    need(cudaStreamEndCapture(stream, &graph_));
    need(cudaGraphInstantiate(&ready_, graph_, 0));
  }
  ~Graph() {
    if (ready_) (void)cudaGraphExecDestroy(ready_);
    if (graph_) (void)cudaGraphDestroy(graph_);
  }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;
  void launch(cudaStream_t stream) const { need(cudaGraphLaunch(ready_, stream)); }

 private:
  cudaGraph_t graph_ = nullptr;
  cudaGraphExec_t ready_ = nullptr;
};

// Device memory in use by all processes, as the driver counts it.
inline std::size_t device_bytes_in_use() {
  std::size_t free = 0, total = 0;
  need(cudaMemGetInfo(&free, &total));
  return total - free;
}

// The pair_checksum() of pairs in device memory, by a kernel.
std::uint64_t device_checksum(const Pair* pairs, std::size_t count, cudaStream_t stream);

}  // namespace throng::bench::gpu
