// Returns small values to a waiting host with low latency. A kernel writes them into pinned memory,
// each word with a sequence number in the same 64 bits, and the host polls until the number is
// current. No copy is issued, no word waits for another, and nothing else is synchronized.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "cuda/check.hpp"
#include "cuda/launch.cuh"

namespace throng::cuda {

// In pinned memory: words, each with the sequence number in its upper half.
struct MailboxBuffer {
  static constexpr unsigned capacity = 96;
  std::uint64_t words[capacity];
};

// Sends a value, with one thread block, and zeroes its first `cleared` words.
struct Post {
  std::uint32_t* from;
  std::uint32_t words, cleared;
  MailboxBuffer* to;
  std::uint32_t number;

  // Called by all threads of a block. Sees all writes before the kernel.
  __device__ void operator()() const {
    for (unsigned k = threadIdx.x; k < words; k += blockDim.x) {
      const std::uint64_t word = std::uint64_t{number} << 32 | __ldcg(from + k);
      *static_cast<volatile std::uint64_t*>(to->words + k) = word;
      if (k < cleared) from[k] = 0;
    }
  }
};

static __global__ void send(Post post) { post(); }

// One thread per index; the last block to finish sends the value.
template <class F>
__global__ void __launch_bounds__(block_threads)
    run_each_and_send(std::uint64_t count, F f, Post post, std::uint32_t* tickets) {
  __shared__ bool last;
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  for (std::uint64_t i = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x; i < count;
       i += step)
    f(i);
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) last = atomicAdd(tickets, 1) == gridDim.x - 1;
  __syncthreads();
  if (!last) return;
  __threadfence();
  if (threadIdx.x == 0) *tickets = 0;
  post();
}

class Mailbox {
 public:
  template <class T>
  static constexpr bool fits = std::is_trivially_copyable_v<T> && sizeof(T) % 4 == 0 &&
                               alignof(T) % 4 == 0 && sizeof(T) / 4 <= MailboxBuffer::capacity;

  Mailbox() noexcept = default;
  ~Mailbox() {
    if (buffer_) (void)cudaFreeHost(buffer_);
  }
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  template <class T>
  Post post(const T& value, std::size_t cleared) {
    static_assert(fits<T>);
    if (!buffer_) {
      void* p = nullptr;
      check(cudaHostAlloc(&p, sizeof(MailboxBuffer), cudaHostAllocMapped));
      buffer_ = static_cast<MailboxBuffer*>(p);
      sequence_number_ = 0;
    }
    // The sequence number wraps around: the words are cleared, so that none has a number used
    // again.
    if (sequence_number_ == 0) *buffer_ = MailboxBuffer{};
    if (++sequence_number_ == 0) return post(value, cleared);
    auto* from = reinterpret_cast<std::uint32_t*>(const_cast<T*>(&value));
    return {from, sizeof(T) / 4, static_cast<std::uint32_t>(cleared / 4), buffer_,
            sequence_number_};
  }
  // Waits for the value of the last post(), whose kernel has been launched on `stream`.
  template <class T>
  T wait(cudaStream_t stream) const {
    std::uint32_t words[sizeof(T) / 4];
    for (unsigned k = 0; k < sizeof(T) / 4; ++k) words[k] = word(k, stream);
    T value;
    std::memcpy(static_cast<void*>(&value), words, sizeof value);
    return value;
  }

 private:
  std::uint32_t word(unsigned k, cudaStream_t stream) const {
    const std::atomic_ref<std::uint64_t> word(buffer_->words[k]);
    for (unsigned polls = 1;; ++polls) {
      // From time to time checks whether the stream has failed or ended.
      const cudaError_t state = polls % 4096 ? cudaErrorNotReady : cudaStreamQuery(stream);
      const std::uint64_t seen = word.load(std::memory_order_relaxed);
      if (seen >> 32 == sequence_number_) return static_cast<std::uint32_t>(seen);
      if (state == cudaErrorNotReady) continue;
      check(state);
      check(cudaErrorUnknown);
    }
  }

  MailboxBuffer* buffer_ = nullptr;
  std::uint32_t sequence_number_ = 0;
};

}  // namespace throng::cuda
