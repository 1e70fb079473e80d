// The few atomic operations that threads of either side share. Relaxed: a launch ends before its
// results are read.
#pragma once

#include <cstdint>

#if !defined(__CUDA_ARCH__)
#include <atomic>
#endif

#include "core/hd.hpp"

namespace throng::paper {

THRONG_HD inline void atomic_or(std::uint32_t* word, std::uint32_t bits) noexcept {
#if defined(__CUDA_ARCH__)
  atomicOr(word, bits);
#else
  std::atomic_ref<std::uint32_t>(*word).fetch_or(bits, std::memory_order_relaxed);
#endif
}

// These give the value before.
THRONG_HD inline std::uint32_t atomic_add(std::uint32_t* value, std::uint32_t more) noexcept {
#if defined(__CUDA_ARCH__)
  return atomicAdd(value, more);
#else
  return std::atomic_ref<std::uint32_t>(*value).fetch_add(more, std::memory_order_relaxed);
#endif
}

THRONG_HD inline std::uint64_t atomic_add(std::uint64_t* value, std::uint64_t more) noexcept {
#if defined(__CUDA_ARCH__)
  // std::uint64_t is unsigned long, for which there is no atomicAdd; both have 64 bits.
  return atomicAdd(reinterpret_cast<unsigned long long*>(value),
                   static_cast<unsigned long long>(more));
#else
  return std::atomic_ref<std::uint64_t>(*value).fetch_add(more, std::memory_order_relaxed);
#endif
}

}  // namespace throng::paper
