// Asks for a cache line that will be written soon.
#pragma once

namespace throng::cpu {

inline void prefetch([[maybe_unused]] const void* address) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(address, 1);
  // GCC takes a function that only prefetches for one without effect, and drops calls of it.
  __asm__ volatile("");
#endif
}

}  // namespace throng::cpu
