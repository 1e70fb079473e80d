// Prefetch instructions.
#pragma once

#include <cstddef>

namespace throng::base {

// Prefetch distance for reading pairs in sequence.
constexpr std::size_t pairs_ahead = 256;

// For a line that will be written soon.
inline void prefetch([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address, 1);
  // GCC treats a function that only prefetches as free of side effects, and drops calls of it.
  __asm__ volatile("");
#endif
}

// For a line that will be written soon and that another core may own: acquires ownership.
// Processors without the instruction ignore it.
inline void prefetch_exclusive([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__) && defined(__x86_64__)
  __asm__ volatile("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
  prefetch(address);
#endif
}

// For a line that will be read later: into L2.
inline void prefetch_l2([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address, 0, 2);
  __asm__ volatile("");
#endif
}

// For a line of a sequential read: into L1.
inline void prefetch_l1([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address, 0, 3);
  __asm__ volatile("");
#endif
}

}  // namespace throng::base
