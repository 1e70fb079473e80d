// The few atomic operations of the pipeline, on the host and on a device.
#pragma once

#include <atomic>
#include <cstdint>

#include "core/hd.hpp"

namespace throng::pipeline {

// Relaxed: what is counted or claimed is read only after all threads of a launch have returned.
THRONG_HD inline std::uint32_t fetch_add(std::uint32_t* at, std::uint32_t value) noexcept {
#if defined(__CUDA_ARCH__)
  return atomicAdd(at, value);
#else
  return std::atomic_ref<std::uint32_t>(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}
THRONG_HD inline std::uint64_t fetch_add(std::uint64_t* at, std::uint64_t value) noexcept {
#if defined(__CUDA_ARCH__)
  static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t));
  return atomicAdd(reinterpret_cast<unsigned long long*>(at),
                   static_cast<unsigned long long>(value));
#else
  return std::atomic_ref<std::uint64_t>(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}
THRONG_HD inline void fetch_max(std::uint32_t* at, std::uint32_t value) noexcept {
#if defined(__CUDA_ARCH__)
  atomicMax(at, value);
#else
  std::atomic_ref<std::uint32_t> cell(*at);
  std::uint32_t seen = cell.load(std::memory_order_relaxed);
  while (value > seen && !cell.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
#endif
}
THRONG_HD inline void fetch_max(std::uint64_t* at, std::uint64_t value) noexcept {
#if defined(__CUDA_ARCH__)
  atomicMax(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  std::atomic_ref<std::uint64_t> cell(*at);
  std::uint64_t seen = cell.load(std::memory_order_relaxed);
  while (value > seen && !cell.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
#endif
}
THRONG_HD inline void fetch_or(std::uint32_t* at, std::uint32_t bits) noexcept {
#if defined(__CUDA_ARCH__)
  atomicOr(at, bits);
#else
  std::atomic_ref<std::uint32_t>(*at).fetch_or(bits, std::memory_order_relaxed);
#endif
}
// Sets a flag that many threads set: most only read it.
THRONG_HD inline void raise(std::uint32_t* flag) noexcept {
#if defined(__CUDA_ARCH__)
  if (*static_cast<volatile std::uint32_t*>(flag) == 0)
    *static_cast<volatile std::uint32_t*>(flag) = 1;
#else
  std::atomic_ref<std::uint32_t> cell(*flag);
  if (cell.load(std::memory_order_relaxed) == 0) cell.store(1, std::memory_order_relaxed);
#endif
}

}  // namespace throng::pipeline
