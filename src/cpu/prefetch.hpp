// Asks for cache lines ahead of need.
#pragma once

#include <cstddef>

namespace throng::cpu {

// Pairs that are gone through in a row are asked for so many ahead.
constexpr std::size_t pairs_ahead = 256;

// One that will be written soon.
inline void prefetch([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address, 1);
  // GCC takes a function that only prefetches for one without effect, and drops calls of it.
  __asm__ volatile("");
#endif
}

// One that will be written soon and that another thread may have: it is to be this one's own by
// then. To a processor older than the instruction it means nothing.
inline void prefetch_to_own([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__) && defined(__x86_64__)
  __asm__ volatile("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
  prefetch(address);
#endif
}

// One that will be read, but not at once: into the second level of cache.
inline void prefetch_to_read([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address, 0, 2);
  __asm__ volatile("");
#endif
}

// One of many in a row that will be read: into the first.
inline void prefetch_to_stream([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address, 0, 3);
  __asm__ volatile("");
#endif
}

}  // namespace throng::cpu
