// Sorting columns of numbers over vectors. Included once an instruction set.
#if defined(THRONG_KERNELS_COLUMNS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_COLUMNS_INL
#undef THRONG_KERNELS_COLUMNS_INL
#else
#define THRONG_KERNELS_COLUMNS_INL
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "cpu/kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Some columns, side by side in one vector a row.
class Columns {
  static constexpr hn::CappedTag<std::uint32_t, sorted_columns> d{};
  using V = hn::Vec<hn::CappedTag<std::uint32_t, sorted_columns>>;

 public:
  static constexpr std::uint32_t width = static_cast<std::uint32_t>(hn::MaxLanes(d));
  HWY_INLINE Columns(std::uint32_t* first, std::uint32_t rows) : first_(first), rows_(rows) {}

  // Batcher's bitonic network. Rows beyond the last count as greater than all: what is compared
  // with them stays. Two steps at a time go through registers, and the last three.
  HWY_INLINE void sort() const {
    each_eight([](V* v) HWY_ATTR {
      order(v[0], v[1]), order(v[2], v[3]), order(v[4], v[5]), order(v[6], v[7]);
      order(v[0], v[2]), order(v[1], v[3]), order(v[4], v[6]), order(v[5], v[7]);
      order(v[1], v[2]), order(v[5], v[6]), order(v[0], v[4]), order(v[3], v[7]);
      order(v[1], v[5]), order(v[2], v[6]);
      order(v[1], v[4]), order(v[3], v[6]);
      order(v[2], v[4]), order(v[3], v[5]);
      order(v[3], v[4]);
    });
    for (std::uint32_t sorted = 8; sorted < rows_; sorted *= 2) {
      std::uint32_t apart = sorted;
      if (apart >= 16) {
        two_steps<true>(apart);
        for (apart /= 4; apart >= 16; apart /= 4) two_steps<false>(apart);
        if (apart == 8) step<false>(8, 0);
      } else {
        step<true>(8, 0);
      }
      each_eight([](V* v) HWY_ATTR {
        order(v[0], v[4]), order(v[1], v[5]), order(v[2], v[6]), order(v[3], v[7]);
        order(v[0], v[2]), order(v[1], v[3]), order(v[4], v[6]), order(v[5], v[7]);
        order(v[0], v[1]), order(v[2], v[3]), order(v[4], v[5]), order(v[6], v[7]);
      });
    }
  }

 private:
  HWY_INLINE std::uint32_t* row(std::uint32_t r) const { return first_ + r * sorted_columns; }
  static HWY_INLINE void order(V& a, V& b) {
    const V least = hn::Min(a, b);
    b = hn::Max(a, b);
    a = least;
  }
  template <class Network>
  HWY_INLINE void each_eight(const Network& network) const {
    for (std::uint32_t r = 0; r < rows_; r += 8) {
      V v[8];
      for (std::uint32_t i = 0; i < 8; ++i) v[i] = hn::LoadU(d, row(r + i));
      network(v);
      for (std::uint32_t i = 0; i < 8; ++i) hn::StoreU(v[i], d, row(r + i));
    }
  }
  // Of each block of 2 * apart rows, from row `begin` on, the first half's with the second's: in
  // turn, or mirrored, the first with the last.
  template <bool mirrored>
  HWY_INLINE void step(std::uint32_t apart, std::uint32_t begin) const {
    for (std::uint32_t b = begin + apart; b < rows_; b += 2 * apart) {
      const std::uint32_t n = std::min(apart, rows_ - b);
      for (std::uint32_t i = 0; i < n; ++i) {
        std::uint32_t *const x = row(mirrored ? b - 1 - i : b - apart + i), *const y = row(b + i);
        V v0 = hn::LoadU(d, x), v1 = hn::LoadU(d, y);
        order(v0, v1);
        hn::StoreU(v0, d, x);
        hn::StoreU(v1, d, y);
      }
    }
  }
  // The steps of `apart` and of half of it.
  template <bool mirrored>
  HWY_INLINE void two_steps(std::uint32_t apart) const {
    const std::uint32_t half = apart / 2;
    std::uint32_t b = 0;
    for (; b + 2 * apart <= rows_; b += 2 * apart) {
      for (std::uint32_t i = b; i < b + half; ++i) {
        const std::uint32_t last = mirrored ? 2 * (b + apart) - 1 - i : i + apart + half;
        std::uint32_t *const r0 = row(i), *const r1 = row(i + half),
                             *const r2 = row(mirrored ? last - half : i + apart),
                             *const r3 = row(last);
        V v0 = hn::LoadU(d, r0), v1 = hn::LoadU(d, r1), v2 = hn::LoadU(d, r2),
          v3 = hn::LoadU(d, r3);
        order(v0, mirrored ? v3 : v2);
        order(v1, mirrored ? v2 : v3);
        order(v0, v1);
        order(v2, v3);
        hn::StoreU(v0, d, r0);
        hn::StoreU(v1, d, r1);
        hn::StoreU(v2, d, r2);
        hn::StoreU(v3, d, r3);
      }
    }
    step<mirrored>(apart, b);
    step<false>(half, b);
  }

  std::uint32_t* first_;
  std::uint32_t rows_;
};

inline void sort_columns(std::uint32_t* numbers, std::uint32_t rows) {
  for (std::uint32_t c = 0; c < sorted_columns; c += Columns::width) {
    Columns(numbers + c, rows).sort();
  }
}

}  // namespace throng::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
