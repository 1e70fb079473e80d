// Sorts lists of pairs side by side, one list per vector lane. Included once per instruction set.
#if defined(THRONG_KERNELS_SORT_LISTS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_SORT_LISTS_INL
#undef THRONG_KERNELS_SORT_LISTS_INL
#else
#define THRONG_KERNELS_SORT_LISTS_INL
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class V>
HWY_INLINE void compare_exchange(V& a, V& b) {
  const V least = hn::Min(a, b);
  b = hn::Max(a, b);
  a = least;
}

// Sorting network over eight rows, per lane.
template <class V>
HWY_INLINE void sort_eight_rows(V* v) {
  compare_exchange(v[0], v[1]), compare_exchange(v[2], v[3]), compare_exchange(v[4], v[5]),
      compare_exchange(v[6], v[7]);
  compare_exchange(v[0], v[2]), compare_exchange(v[1], v[3]), compare_exchange(v[4], v[6]),
      compare_exchange(v[5], v[7]);
  compare_exchange(v[1], v[2]), compare_exchange(v[5], v[6]), compare_exchange(v[0], v[4]),
      compare_exchange(v[3], v[7]);
  compare_exchange(v[1], v[5]), compare_exchange(v[2], v[6]);
  compare_exchange(v[1], v[4]), compare_exchange(v[3], v[6]);
  compare_exchange(v[2], v[4]), compare_exchange(v[3], v[5]);
  compare_exchange(v[3], v[4]);
}

// Columns of a row-major array, one per lane.
class LaneColumns {
  static constexpr hn::CappedTag<std::uint32_t, lists_per_sort> d{};
  using V = hn::Vec<hn::CappedTag<std::uint32_t, lists_per_sort>>;

 public:
  static constexpr std::uint32_t width = static_cast<std::uint32_t>(hn::MaxLanes(d));
  HWY_INLINE LaneColumns(std::uint32_t* first, std::uint32_t rows) : first_(first), rows_(rows) {}

  // Batcher's bitonic network. Rows past the end count as the maximum, so comparing with them is a
  // no-op. Steps are fused in registers: two at a time, and the last three.
  HWY_INLINE void sort() const {
    for_each_eight_rows([](V* v) HWY_ATTR { sort_eight_rows(v); });
    for (std::uint32_t sorted = 8; sorted < rows_; sorted *= 2) {
      std::uint32_t distance = sorted;
      if (distance >= 16) {
        two_steps<true>(distance);
        for (distance /= 4; distance >= 16; distance /= 4) two_steps<false>(distance);
        if (distance == 8) step<false>(8, 0);
      } else {
        step<true>(8, 0);
      }
      for_each_eight_rows([](V* v) HWY_ATTR {
        compare_exchange(v[0], v[4]), compare_exchange(v[1], v[5]), compare_exchange(v[2], v[6]),
            compare_exchange(v[3], v[7]);
        compare_exchange(v[0], v[2]), compare_exchange(v[1], v[3]), compare_exchange(v[4], v[6]),
            compare_exchange(v[5], v[7]);
        compare_exchange(v[0], v[1]), compare_exchange(v[2], v[3]), compare_exchange(v[4], v[5]),
            compare_exchange(v[6], v[7]);
      });
    }
  }

 private:
  HWY_INLINE std::uint32_t* row(std::uint32_t r) const { return first_ + r * lists_per_sort; }
  template <class Network>
  HWY_INLINE void for_each_eight_rows(const Network& network) const {
    for (std::uint32_t r = 0; r < rows_; r += 8) {
      V v[8];
      for (std::uint32_t i = 0; i < 8; ++i) v[i] = hn::LoadU(d, row(r + i));
      network(v);
      for (std::uint32_t i = 0; i < 8; ++i) hn::StoreU(v[i], d, row(r + i));
    }
  }
  // For each block of 2 * distance rows from row `begin` on: compares the first half with the
  // second, in the same order, or mirrored (first with last).
  template <bool mirrored>
  HWY_INLINE void step(std::uint32_t distance, std::uint32_t begin) const {
    for (std::uint32_t b = begin + distance; b < rows_; b += 2 * distance) {
      const std::uint32_t n = std::min(distance, rows_ - b);
      for (std::uint32_t i = 0; i < n; ++i) {
        std::uint32_t *const x = row(mirrored ? b - 1 - i : b - distance + i), *const y =
                                                                                   row(b + i);
        V v0 = hn::LoadU(d, x), v1 = hn::LoadU(d, y);
        compare_exchange(v0, v1);
        hn::StoreU(v0, d, x);
        hn::StoreU(v1, d, y);
      }
    }
  }
  // The steps of distance `distance` and `distance` / 2, fused.
  template <bool mirrored>
  HWY_INLINE void two_steps(std::uint32_t distance) const {
    const std::uint32_t half = distance / 2;
    std::uint32_t b = 0;
    for (; b + 2 * distance <= rows_; b += 2 * distance) {
      for (std::uint32_t i = b; i < b + half; ++i) {
        const std::uint32_t last = mirrored ? 2 * (b + distance) - 1 - i : i + distance + half;
        std::uint32_t *const r0 = row(i), *const r1 = row(i + half),
                             *const r2 = row(mirrored ? last - half : i + distance),
                             *const r3 = row(last);
        V v0 = hn::LoadU(d, r0), v1 = hn::LoadU(d, r1), v2 = hn::LoadU(d, r2),
          v3 = hn::LoadU(d, r3);
        compare_exchange(v0, mirrored ? v3 : v2);
        compare_exchange(v1, mirrored ? v2 : v3);
        compare_exchange(v0, v1);
        compare_exchange(v2, v3);
        hn::StoreU(v0, d, r0);
        hn::StoreU(v1, d, r1);
        hn::StoreU(v2, d, r2);
        hn::StoreU(v3, d, r3);
      }
    }
    step<mirrored>(distance, b);
    step<false>(half, b);
  }

  std::uint32_t* first_;
  std::uint32_t rows_;
};

// An 8 x 8 tile of eight lists' seconds in registers: one vector per list or per row.
template <std::uint32_t width>  // pairs per vector
class Tile8x8 {
  static constexpr hn::CappedTag<std::uint32_t, 8> d{};
  static constexpr hn::CappedTag<std::uint64_t, width> d_pair{};
  static constexpr hn::Repartition<std::uint64_t, decltype(d)> d_two{};
  using V = hn::Vec<hn::CappedTag<std::uint32_t, 8>>;

 public:
  // Loads from row `begin` on. Rows past a list's end are the maximum.
  HWY_INLINE void load_lists(const PairList* lists, std::uint32_t begin) {
    for (std::uint32_t i = 0; i < 8; ++i) v_[i] = seconds(lists[i], begin);
    transpose();
  }
  HWY_INLINE void store_lists(const PairList* lists, std::uint32_t begin) {
    transpose();
    for (std::uint32_t i = 0; i < 8; ++i) store(v_[i], lists[i], begin);
  }
  HWY_INLINE void load_rows(const std::uint32_t* scratch) {
    for (std::uint32_t i = 0; i < 8; ++i) v_[i] = hn::LoadU(d, scratch + i * lists_per_sort);
  }
  HWY_INLINE void store_rows(std::uint32_t* scratch) const {
    for (std::uint32_t i = 0; i < 8; ++i) hn::StoreU(v_[i], d, scratch + i * lists_per_sort);
  }
  HWY_INLINE void sort() { sort_eight_rows(v_); }

 private:
  static HWY_INLINE V seconds(const PairList& list, std::uint32_t begin) {
    const V most = hn::Set(d, ~std::uint32_t{0});
    if (list.count <= begin) return most;
    const auto valid = hn::FirstN(d, std::min(list.count - begin, 8u));
    return hn::IfThenElse(valid, hn::MaskedLoad(valid, d, list.seconds + begin), most);
  }
  static HWY_INLINE void store(V v, const PairList& list, std::uint32_t begin) {
    if (list.count <= begin) return;
    auto* const to = reinterpret_cast<std::uint64_t*>(list.to + begin);
    const std::uint32_t left = list.count - begin;
    const auto first = hn::Set(d_pair, std::uint64_t{list.first});
    const auto store_pairs = [&](auto seconds, std::uint32_t at) HWY_ATTR {
      const auto pairs = hn::Or(hn::ShiftLeft<32>(hn::PromoteTo(d_pair, seconds)), first);
      if (width == 4 && left >= at + 4)  // masked stores are slow there
        hn::StoreU(pairs, d_pair, to + at);
      else if (left > at)
        hn::BlendedStore(pairs, hn::FirstN(d_pair, std::min(left - at, width)), d_pair, to + at);
    };
    if constexpr (width == 8) {
      store_pairs(v, 0);
    } else {
      const hn::Half<decltype(d)> d_half;
      store_pairs(hn::LowerHalf(d_half, v), 0);
      store_pairs(hn::UpperHalf(d_half, v), 4);
    }
  }
  HWY_INLINE void transpose() {
    V a[8];
    for (std::uint32_t i = 0; i < 8; i += 2) {
      a[i] = hn::InterleaveLower(d, v_[i], v_[i + 1]);
      a[i + 1] = hn::InterleaveUpper(d, v_[i], v_[i + 1]);
    }
    V b[8];
    for (std::uint32_t i = 0; i < 8; i += 4) {
      for (std::uint32_t k = 0; k < 2; ++k) {
        const auto x = hn::BitCast(d_two, a[i + k]), y = hn::BitCast(d_two, a[i + 2 + k]);
        b[i + 2 * k] = hn::BitCast(d, hn::InterleaveLower(d_two, x, y));
        b[i + 2 * k + 1] = hn::BitCast(d, hn::InterleaveUpper(d_two, x, y));
      }
    }
    for (std::uint32_t i = 0; i < 4; ++i) {
      v_[i] = hn::ConcatLowerLower(d, b[i + 4], b[i]);
      v_[i + 4] = hn::ConcatUpperUpper(d, b[i + 4], b[i]);
    }
  }

  V v_[8];
};

// Needs vectors of eight values or more.
template <std::uint32_t pairs_per_vector>
void sort_lists(const PairList* lists, std::uint32_t rows, std::uint32_t* scratch) {
  Tile8x8<pairs_per_vector> block;
  for (std::uint32_t c = 0; c < lists_per_sort; c += 8) {
    for (std::uint32_t r = 0; r < rows; r += 8) {
      block.load_lists(lists + c, r);
      if (rows > 8) {
        block.store_rows(scratch + r * lists_per_sort + c);
      } else {
        block.sort();
        block.store_lists(lists + c, r);
      }
    }
  }
  if (rows <= 8) return;
  for (std::uint32_t c = 0; c < lists_per_sort; c += LaneColumns::width)
    LaneColumns(scratch + c, rows).sort();
  for (std::uint32_t c = 0; c < lists_per_sort; c += 8) {
    for (std::uint32_t r = 0; r < rows; r += 8) {
      block.load_rows(scratch + r * lists_per_sort + c);
      block.store_lists(lists + c, r);
    }
  }
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
