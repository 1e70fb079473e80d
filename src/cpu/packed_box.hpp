// A box such that one kind of comparison decides an overlap: two vectors of four at most.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

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

// The box whose overlaps are asked for: what no corner of the other may exceed.
class PackedQuery {
 public:
  explicit PackedQuery(const Box& b) noexcept {
    most_.set({{b.upper.x, b.upper.y, b.upper.z}, {b.lower.x, b.lower.y, b.lower.z}});
    most_.id = most_.link = 0;
  }
  bool overlaps(const PackedBox& b) const noexcept {
#if defined(THRONG_PACKED_SSE2)
    // The last two lanes are numbers, not corners.
    const int first =
        _mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(b.corner), _mm_load_ps(most_.corner)));
    const int rest =
        _mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(b.corner + 4), _mm_load_ps(most_.corner + 4)));
    return (first & (rest | 12)) == 15;
#else
    bool all = true;
    for (int k = 0; k < 6; ++k) all &= b.corner[k] <= most_.corner[k];
    return all;
#endif
  }

 private:
  PackedBox most_;
};

}  // namespace throng::cpu
