// Two boxes in a cache line; three vector comparisons test both against a third box.
#pragma once

#include <cstdint>
#include <limits>

#include <throng/types.hpp>

#include "base/sse2.hpp"

namespace throng::tracking {

// Two boxes in structure-of-arrays order, the upper corners negated (exact: it flips the sign bit).
// `next` and `used` belong to the owner. A box of NaNs overlaps nothing.
struct alignas(64) CellLine {
  float corner[6][2];
  std::uint32_t id[2], next, used;

  static constexpr CellLine empty() noexcept {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    return {{{nan, nan}, {nan, nan}, {nan, nan}, {nan, nan}, {nan, nan}, {nan, nan}},
            {0xffffffffu, 0xffffffffu},
            0,
            0};
  }
  void set(std::uint32_t k, const Box& b) noexcept {
    const float c[6] = {b.lower.x, b.lower.y, b.lower.z, -b.upper.x, -b.upper.y, -b.upper.z};
    for (int i = 0; i < 6; ++i) corner[i][k] = c[i];
  }
  void set(const Box& first, const Box& second) noexcept {
#if defined(THRONG_SSE2)
    const auto front = [](const Box& b) { return _mm_loadu_ps(&b.lower.x); };
    const auto back = [](const Box& b) {
      return _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(&b.upper.y)));
    };
    const __m128 a = front(first), b = front(second);
    _mm_store_ps(corner[0], _mm_unpacklo_ps(a, b));
    _mm_store_ps(corner[2], _mm_xor_ps(_mm_unpackhi_ps(a, b), _mm_setr_ps(0, 0, -0.0f, -0.0f)));
    _mm_store_ps(corner[4],
                 _mm_xor_ps(_mm_unpacklo_ps(back(first), back(second)), _mm_set1_ps(-0.0f)));
#else
    set(0, first);
    set(1, second);
#endif
  }
  Box box(std::uint32_t k) const noexcept {
    return {{corner[0][k], corner[1][k], corner[2][k]},
            {-corner[3][k], -corner[4][k], -corner[5][k]}};
  }
};

static_assert(sizeof(CellLine) == 64);

// The query box, as upper bounds of the other box's corners.
class CellQuery {
 public:
  explicit CellQuery(const Box& b) noexcept {
    const float most[6] = {b.upper.x, b.upper.y, b.upper.z, -b.lower.x, -b.lower.y, -b.lower.z};
#if defined(THRONG_SSE2)
    for (int i = 0; i < 3; ++i)
      bound_[i] = _mm_setr_ps(most[2 * i], most[2 * i], most[2 * i + 1], most[2 * i + 1]);
#else
    for (int i = 0; i < 6; ++i) bound_[i] = most[i];
#endif
  }
  // Bits 0 and 1: whether each of the two overlaps.
  std::uint32_t overlaps(const CellLine& line) const noexcept {
#if defined(THRONG_SSE2)
    const auto both = [&](int i) {  // of two coordinates
      return _mm_cmple_ps(_mm_load_ps(line.corner[2 * i]), bound_[i]);
    };
    const auto m = static_cast<std::uint32_t>(
        _mm_movemask_ps(_mm_and_ps(_mm_and_ps(both(0), both(1)), both(2))));
    return m & m >> 2;
#else
    bool both[2] = {true, true};
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 2; ++k) both[k] &= line.corner[i][k] <= bound_[i];
    }
    return (both[0] ? 1u : 0u) | (both[1] ? 2u : 0u);
#endif
  }

 private:
#if defined(THRONG_SSE2)
  __m128 bound_[3];
#else
  float bound_[6];
#endif
};

}  // namespace throng::tracking
