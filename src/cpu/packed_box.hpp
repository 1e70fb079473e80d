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

// Lower corner, and the upper one negated: exact, as a float's sign is a bit of its own. With two
// numbers of whoever keeps it. All NaN: overlaps nothing.
struct alignas(16) PackedBox {
  float corner[6];
  std::uint32_t id, link;

  void set(const Box& b) noexcept {
    const float c[6] = {b.lower.x, b.lower.y, b.lower.z, -b.upper.x, -b.upper.y, -b.upper.z};
    for (int k = 0; k < 6; ++k) corner[k] = c[k];
  }
  Box box() const noexcept {
    return {{corner[0], corner[1], corner[2]}, {-corner[3], -corner[4], -corner[5]}};
  }
};

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

// Two boxes, a cache line.
struct alignas(64) PackedLine {
  PackedBox entry[2];
};

// The box whose overlaps are asked for: what no corner of the other may exceed.
#if defined(THRONG_PACKED_SSE2)
class PackedQuery {
 public:
  explicit PackedQuery(const Box& b) noexcept {
    const auto* corner = reinterpret_cast<const float*>(&b);
    const __m128 v0 = _mm_loadu_ps(corner), v1 = _mm_loadu_ps(corner + 2);
    const __m128 zx = _mm_shuffle_ps(v1, v0, _MM_SHUFFLE(0, 0, 3, 3));
    first_ = _mm_xor_ps(_mm_shuffle_ps(v1, zx, _MM_SHUFFLE(2, 0, 2, 1)),
                        _mm_setr_ps(0.0f, 0.0f, 0.0f, -0.0f));
    rest_ = _mm_xor_ps(_mm_shuffle_ps(v0, v0, _MM_SHUFFLE(2, 2, 2, 1)), _mm_set1_ps(-0.0f));
  }
  // Whether each of the two overlaps: bits 0 and 1.
  std::uint32_t overlaps(const PackedLine& line) const noexcept {
    // The two lanes that are numbers, not corners, count as good.
    const __m128 good = _mm_castsi128_ps(_mm_setr_epi32(0, 0, -1, -1));
    const auto both = [&](const PackedBox& b) {
      const __m128 rest = _mm_cmple_ps(_mm_load_ps(b.corner + 4), rest_);
      return _mm_castps_si128(
          _mm_and_ps(_mm_cmple_ps(_mm_load_ps(b.corner), first_), _mm_or_ps(rest, good)));
    };
    const __m128i lanes = _mm_packs_epi32(both(line.entry[0]), both(line.entry[1]));
    auto m = static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(lanes, lanes)));
    m &= m >> 1;
    m &= m >> 2;
    return (m & 1) | (m >> 3 & 2);
  }

 private:
  __m128 first_, rest_;
};
#else
class PackedQuery {
 public:
  explicit PackedQuery(const Box& b) noexcept { most_.set({b.upper, b.lower}); }
  std::uint32_t overlaps(const PackedLine& line) const noexcept {
    bool both[2] = {true, true};
    for (int i = 0; i < 2; ++i) {
      for (int k = 0; k < 6; ++k) both[i] &= line.entry[i].corner[k] <= most_.corner[k];
    }
    return (both[0] ? 1u : 0u) | (both[1] ? 2u : 0u);
  }

 private:
  PackedBox most_;
};
#endif

}  // namespace throng::cpu
