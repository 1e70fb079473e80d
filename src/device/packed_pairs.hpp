// Pairs as integers that sort in the same order: load, store, batched access, and the merge of
// sorted runs.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"

namespace throng::device {

// (first << 32) | second.
using PackedPair = std::uint64_t;

THRONG_HD inline PackedPair load(const PackedPair* at) noexcept { return *at; }
// For the library's memory, which is aligned to 8 bytes.
THRONG_HD inline PackedPair load(const Pair* at) noexcept {
#if defined(__CUDA_ARCH__)
  const uint2 pair = *reinterpret_cast<const uint2*>(at);
  return PackedPair{pair.x} << 32 | pair.y;
#else
  return PackedPair{at->first} << 32 | at->second;
#endif
}
// The caller's memory may be aligned to 4 bytes only.
THRONG_HD inline void store(Pair* at, PackedPair word) noexcept {
  const auto first = static_cast<std::uint32_t>(word >> 32);
  const auto second = static_cast<std::uint32_t>(word);
#if defined(__CUDA_ARCH__)
  if (reinterpret_cast<std::uintptr_t>(at) % sizeof(Pair) == 0)
    *reinterpret_cast<uint2*>(at) = {first, second};
  else
#endif
    *at = {first, second};
}

// Calls put(word, take(word)) for each word of one thread; four loads are in flight at a time.
template <class From, class Take, class Put>
THRONG_HD void each_word(const From* from, std::uint32_t begin, std::uint32_t end,
                         std::uint32_t step, const Take& take, const Put& put) noexcept {
  constexpr std::uint32_t batch = 4;
  THRONG_UNROLL(1)
  for (std::uint32_t first = begin; first < end; first += batch * step) {
    PackedPair word[batch] = {};
    std::uint32_t to[batch] = {};
    THRONG_UNROLL(batch)
    for (std::uint32_t k = 0; k < batch; ++k)
      if (first + k * step < end) word[k] = load(from + first + k * step);
    THRONG_UNROLL(batch)
    for (std::uint32_t k = 0; k < batch; ++k)
      if (first + k * step < end) to[k] = take(word[k]);
    THRONG_UNROLL(batch)
    for (std::uint32_t k = 0; k < batch; ++k)
      if (first + k * step < end) put(word[k], to[k]);
  }
}

// [begin, end) holds consecutive sorted runs of `width`, a power of two. Returns the place of the
// i-th word once each four runs are merged. The binary searches in the three other runs are
// interleaved.
THRONG_HD inline std::uint32_t merged(const PackedPair* from, std::uint32_t begin,
                                      std::uint32_t end, std::uint32_t i,
                                      std::uint32_t width) noexcept {
  const PackedPair word = from[i];
  const std::uint32_t own = (i - begin) / width % 4;
  const std::uint32_t four = i - (i - begin) % width - own * width;
  std::uint32_t to = i - own * width;
  std::uint32_t firsts[3], sizes[3], less[3] = {};
  THRONG_UNROLL(3)
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t skipped = (k + (k >= own)) * width;
    const std::uint32_t rest = end - four > skipped ? end - four - skipped : 0;
    firsts[k] = four + skipped;
    sizes[k] = rest < width ? rest : width;
  }
  THRONG_UNROLL(1)
  for (std::uint32_t step = width; step > 0; step /= 2) {
    THRONG_UNROLL(3)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t next = less[k] + step;
      if (next <= sizes[k] && from[firsts[k] + next - 1] < word) less[k] = next;
    }
  }
  THRONG_UNROLL(3)
  for (std::uint32_t k = 0; k < 3; ++k) to += less[k];
  return to;
}

}  // namespace throng::device
