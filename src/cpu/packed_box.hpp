// Boxes whose overlaps two vectors of four decide: as they lie in memory, and such that one kind of
// comparison does.
#pragma once

#include <cstdint>
#include <cstring>

#include <throng/types.hpp>

#include "core/bounds.hpp"

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#define THRONG_PACKED_SSE2 1
#endif

namespace throng::cpu {

// core::overlaps() of two boxes as they lie in memory, their six floats together.
inline bool overlap_in_memory(const char* a, const char* b) noexcept {
#if defined(THRONG_PACKED_SSE2)
  const auto floats = [](const char* at) {
    return _mm_loadu_ps(reinterpret_cast<const float*>(at));
  };
  const auto upper = [&](const char* box) {
    const __m128 v = floats(box + 2 * sizeof(float));
    return _mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 3, 2, 1));
  };
  // The fourth lanes are of no meaning.
  const __m128 both =
      _mm_and_ps(_mm_cmple_ps(floats(a), upper(b)), _mm_cmple_ps(floats(b), upper(a)));
  return (_mm_movemask_ps(both) & 7) == 7;
#else
  Box boxes[2];
  std::memcpy(boxes, a, sizeof *boxes);
  std::memcpy(boxes + 1, b, sizeof *boxes);
  return core::overlaps(boxes[0], boxes[1]);
#endif
}

// A box's corners in units of 1 / scale, cut to whole numbers of at most `most`: towards zero, so
// nowhere decreasing. Not of a NaN. The fourth number of each is of no meaning.
inline void whole_units(const Box& b, float scale, float most, std::int32_t (&lower)[4],
                        std::int32_t (&upper)[4]) noexcept {
  const auto* corner = reinterpret_cast<const float*>(&b);
#if defined(THRONG_PACKED_SSE2)
  const auto cut = [&](__m128 v) {
    v = _mm_max_ps(_mm_mul_ps(v, _mm_set1_ps(scale)), _mm_set1_ps(-most));
    return _mm_cvttps_epi32(_mm_min_ps(v, _mm_set1_ps(most)));
  };
  const __m128i u = cut(_mm_loadu_ps(corner + 2));
  _mm_store_si128(reinterpret_cast<__m128i*>(lower), cut(_mm_loadu_ps(corner)));
  _mm_store_si128(reinterpret_cast<__m128i*>(upper), _mm_shuffle_epi32(u, 0x39));
#else
  for (int k = 0; k < 4; ++k) {
    const auto cut = [&](float x) {
      x = x * scale;
      x = x > -most ? x : -most;
      return static_cast<std::int32_t>(x < most ? x : most);
    };
    lower[k] = cut(corner[k % 3]);
    upper[k] = cut(corner[3 + k % 3]);
  }
#endif
}

// Two boxes, a cache line: corner by corner, the upper ones negated (exact, as a float's sign is a
// bit of its own). With numbers of whoever keeps it. A box all NaN overlaps nothing.
struct alignas(64) PackedLine {
  float corner[6][2];
  std::uint32_t id[2], next, used;

  void set(std::uint32_t k, const Box& b) noexcept {
    const float c[6] = {b.lower.x, b.lower.y, b.lower.z, -b.upper.x, -b.upper.y, -b.upper.z};
    for (int i = 0; i < 6; ++i) corner[i][k] = c[i];
  }
  Box box(std::uint32_t k) const noexcept {
    return {{corner[0][k], corner[1][k], corner[2][k]},
            {-corner[3][k], -corner[4][k], -corner[5][k]}};
  }
};

static_assert(sizeof(PackedLine) == 64);

// The box whose overlaps are asked for: what no corner of the other may exceed.
class PackedQuery {
 public:
  explicit PackedQuery(const Box& b) noexcept {
    const float most[6] = {b.upper.x, b.upper.y, b.upper.z, -b.lower.x, -b.lower.y, -b.lower.z};
#if defined(THRONG_PACKED_SSE2)
    for (int i = 0; i < 3; ++i)
      most_[i] = _mm_setr_ps(most[2 * i], most[2 * i], most[2 * i + 1], most[2 * i + 1]);
#else
    for (int i = 0; i < 6; ++i) most_[i] = most[i];
#endif
  }
  // Whether each of the two overlaps: bits 0 and 1.
  std::uint32_t overlaps(const PackedLine& line) const noexcept {
#if defined(THRONG_PACKED_SSE2)
    const auto both = [&](int i) {  // of two corners
      return _mm_cmple_ps(_mm_load_ps(line.corner[2 * i]), most_[i]);
    };
    const auto m = static_cast<std::uint32_t>(
        _mm_movemask_ps(_mm_and_ps(_mm_and_ps(both(0), both(1)), both(2))));
    return m & m >> 2;
#else
    bool both[2] = {true, true};
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 2; ++k) both[k] &= line.corner[i][k] <= most_[i];
    }
    return (both[0] ? 1u : 0u) | (both[1] ? 2u : 0u);
#endif
  }

 private:
#if defined(THRONG_PACKED_SSE2)
  __m128 most_[3];
#else
  float most_[6];
#endif
};

}  // namespace throng::cpu
