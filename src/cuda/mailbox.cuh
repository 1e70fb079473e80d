// Small values on their way to a host that waits for them: a kernel writes them into pinned memory,
// each word with a number beside it, which the host looks at until it is there. No copy is asked
// for, no word waits for another, and nothing is synchronised with but this.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "cuda/check.hpp"
#include "cuda/launch.cuh"

namespace throng::cuda {

// In pinned memory: words, the number of the letter in the upper half of each.
struct Letter {
  static constexpr unsigned room = 96;
  std::uint64_t words[room];
};

// What a block of threads does to send a value and, of its first words, leave zeros where it was.
struct Post {
  std::uint32_t* from;
  std::uint32_t words, cleared;
  Letter* to;
  std::uint32_t number;

  // All threads of a block; what was written there before is seen by it.
  __device__ void operator()() const {
    for (unsigned k = threadIdx.x; k < words; k += blockDim.x) {
      const std::uint64_t word = std::uint64_t{number} << 32 | __ldcg(from + k);
      *static_cast<volatile std::uint64_t*>(to->words + k) = word;
      if (k < cleared) from[k] = 0;
    }
  }
};

static __global__ void send(Post post) { post(); }

// One thread for each index; the block that is the last to end sends what all of them left.
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
  static constexpr bool takes = std::is_trivially_copyable_v<T> && sizeof(T) % 4 == 0 &&
                                alignof(T) % 4 == 0 && sizeof(T) / 4 <= Letter::room;

  Mailbox() noexcept = default;
  ~Mailbox() {
    if (letter_) (void)cudaFreeHost(letter_);
  }
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  template <class T>
  Post post(const T& value, std::size_t cleared) {
    static_assert(takes<T>);
    if (!letter_) {
      void* p = nullptr;
      check(cudaHostAlloc(&p, sizeof(Letter), cudaHostAllocMapped));
      letter_ = static_cast<Letter*>(p);
      number_ = 0;
    }
    // Numbers come round: no word is left that has one of these already.
    if (number_ == 0) *letter_ = Letter{};
    if (++number_ == 0) return post(value, cleared);
    auto* from = reinterpret_cast<std::uint32_t*>(const_cast<T*>(&value));
    return {from, sizeof(T) / 4, static_cast<std::uint32_t>(cleared / 4), letter_, number_};
  }
  // What the last post() sends, once the kernel that does it is on the stream.
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
    const std::atomic_ref<std::uint64_t> word(letter_->words[k]);
    for (unsigned looks = 1;; ++looks) {
      // Now and then it is asked whether it can still come.
      const cudaError_t state = looks % 4096 ? cudaErrorNotReady : cudaStreamQuery(stream);
      const std::uint64_t seen = word.load(std::memory_order_relaxed);
      if (seen >> 32 == number_) return static_cast<std::uint32_t>(seen);
      if (state == cudaErrorNotReady) continue;
      check(state);
      check(cudaErrorUnknown);
    }
  }

  Letter* letter_ = nullptr;
  std::uint32_t number_ = 0;
};

}  // namespace throng::cuda
