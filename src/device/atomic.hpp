// Atomic operations of the device pipeline, for host and device.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/atomics.hpp"
#include "base/host_device_macros.hpp"

namespace throng::device {

// Relaxed: counts and claims are read only after all threads of a launch have returned.
THRONG_HD inline std::uint32_t fetch_add(std::uint32_t* at, std::uint32_t value) noexcept {
#if defined(__CUDA_ARCH__)
  return atomicAdd(at, value);
#else
  return base::AtomicRef<std::uint32_t>(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}
THRONG_HD inline std::uint64_t fetch_add(std::uint64_t* at, std::uint64_t value) noexcept {
#if defined(__CUDA_ARCH__)
  static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t));
  return atomicAdd(reinterpret_cast<unsigned long long*>(at),
                   static_cast<unsigned long long>(value));
#else
  return base::AtomicRef<std::uint64_t>(*at).fetch_add(value, std::memory_order_relaxed);
#endif
}
THRONG_HD inline void fetch_max(std::uint32_t* at, std::uint32_t value) noexcept {
#if defined(__CUDA_ARCH__)
  atomicMax(at, value);
#else
  base::AtomicRef<std::uint32_t> cell(*at);
  std::uint32_t seen = cell.load(std::memory_order_relaxed);
  while (value > seen && !cell.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
#endif
}
THRONG_HD inline void fetch_max(std::uint64_t* at, std::uint64_t value) noexcept {
#if defined(__CUDA_ARCH__)
  atomicMax(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  base::AtomicRef<std::uint64_t> cell(*at);
  std::uint64_t seen = cell.load(std::memory_order_relaxed);
  while (value > seen && !cell.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
#endif
}
THRONG_HD inline void fetch_or(std::uint32_t* at, std::uint32_t bits) noexcept {
#if defined(__CUDA_ARCH__)
  atomicOr(at, bits);
#else
  base::AtomicRef<std::uint32_t>(*at).fetch_or(bits, std::memory_order_relaxed);
#endif
}
// Adds one and returns the old value. Threads of a warp that call this together first sum up per
// counter, so that each counter takes one atomic addition.
THRONG_HD inline std::uint64_t fetch_increment(std::uint64_t* at) noexcept {
#if defined(__CUDA_ARCH__)
  const unsigned same = __match_any_sync(__activemask(), reinterpret_cast<unsigned long long>(at));
  const unsigned lane = threadIdx.x % 32;
  const int first = __ffs(static_cast<int>(same)) - 1;
  unsigned long long start = 0;
  if (lane == static_cast<unsigned>(first)) {
    start = atomicAdd(reinterpret_cast<unsigned long long*>(at),
                      static_cast<unsigned long long>(__popc(same)));
  }
  start = __shfl_sync(same, start, first);
  return start + static_cast<unsigned>(__popc(same & ((1u << lane) - 1)));
#else
  return fetch_add(at, std::uint64_t{1});
#endif
}
// Sets a flag that many threads set. Most threads only read it, from the L1 cache, which avoids
// contention on one address. A stale 0 there only causes one more store.
THRONG_HD inline void set_flag(std::uint32_t* flag) noexcept {
#if defined(__CUDA_ARCH__)
  if (__ldca(flag) == 0) *static_cast<volatile std::uint32_t*>(flag) = 1;
#else
  base::AtomicRef<std::uint32_t> cell(*flag);
  if (cell.load(std::memory_order_relaxed) == 0) cell.store(1, std::memory_order_relaxed);
#endif
}
// The same for a maximum; few threads increase it.
THRONG_HD inline void raise_max(std::uint32_t* at, std::uint32_t value) noexcept {
#if defined(__CUDA_ARCH__)
  if (__ldca(at) < value) fetch_max(at, value);
#else
  fetch_max(at, value);
#endif
}
}  // namespace throng::device
