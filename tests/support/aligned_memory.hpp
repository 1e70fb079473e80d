// Aligned memory from the C library, whatever operator new does.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#ifdef _WIN32
#include <malloc.h>
#endif

namespace throng::tests {

// Null if there is none. `alignment` is a power of two.
inline void* allocate_aligned(std::size_t bytes, std::size_t alignment) noexcept {
  const std::size_t step = std::max(alignment, alignof(std::max_align_t));
  const std::size_t whole = (std::max<std::size_t>(bytes, 1) + step - 1) / step * step;
#ifdef _WIN32
  return _aligned_malloc(whole, step);
#else
  return std::aligned_alloc(step, whole);
#endif
}

inline void free_aligned(void* memory) noexcept {
#ifdef _WIN32
  _aligned_free(memory);
#else
  std::free(memory);
#endif
}

}  // namespace throng::tests
