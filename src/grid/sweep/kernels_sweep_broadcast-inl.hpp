// The sweep of a strip against itself where windows are long: a row of queries stays in registers,
// and two targets at a time are broadcast against it. Included once per instruction set.
#if defined(THRONG_KERNELS_SWEEP_BROADCAST_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_SWEEP_BROADCAST_INL
#undef THRONG_KERNELS_SWEEP_BROADCAST_INL
#else
#define THRONG_KERNELS_SWEEP_BROADCAST_INL
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/cost_table.hpp"
#include "grid/sweep/kernels_sweep_block-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t coordinate_lanes = static_cast<std::uint32_t>(hn::MaxLanes(D16()));
constexpr std::uint32_t broadcast_queries = coordinate_lanes / 2;
// It does not pay with vectors of eight coordinates.
constexpr bool broadcast_pays = coordinate_lanes > 8;
// Broadcast is faster than the diagonal sweep (kernels_sweep_diagonal-inl.hpp) if the last window
// of a vector of queries ends at least this far after its first query. It wastes half of the
// comparisons of the first broadcast_queries targets.
HWY_INLINE std::uint32_t min_broadcast_window() {
  return coordinate_lanes + static_cast<std::uint32_t>(base::cost.broadcast_window);
}

// Returns v0, v0, v1, v1, ... `wide` is the unsigned tag of twice the width.
template <class D, class T>
HWY_INLINE hn::Vec<D> duplicate_each(D wide, const T* values) {
  const hn::Rebind<T, D> half;
  const auto once = hn::PromoteTo(wide, hn::LoadU(half, values));
  return hn::Or(once, hn::ShiftLeft<8 * sizeof(T)>(once));
}
// Returns v0, v1, v0, v1, ...
template <class D, class T>
HWY_INLINE hn::Vec<D> alternate_two(D wide, const T* values) {
  hn::TFromD<D> both;
  static_assert(sizeof both == 2 * sizeof(T));
  std::memcpy(&both, values, sizeof both);
  return hn::Set(wide, both);
}

// Below 0 where a target does not come after its query. Load from `values` + `most` - 2 * (first
// target - first query).
struct UpperTriangle {
  static constexpr std::uint32_t most = 2 * (broadcast_queries + 8);
  std::int16_t values[most + coordinate_lanes] = {};
  constexpr UpperTriangle() {
    for (std::uint32_t k = most; k < most + coordinate_lanes; ++k) values[k] = -32767;
    values[most + 1] = 0;  // the first of two precedes the second
  }
};
inline constexpr UpperTriangle upper_triangle;

// Half as many queries as lanes, each coordinate twice, because targets come in twos. With one
// query per lane the first targets would waste twice as many comparisons; and a 32-bit broadcast is
// one load, a 16-bit one on some processors a load and a shuffle.
struct BroadcastOrder {
  using D = D16;
  using DTwo = hn::Repartition<std::uint32_t, D>;
  static constexpr std::size_t targets_per_vector = 2;

  struct Duplicated {
    const Strip& s;
    std::size_t i;
    HWY_INLINE V16 load(const std::int16_t* values) const {
      const auto* const from = reinterpret_cast<const std::uint16_t*>(values + i);
      return hn::BitCast(D(), duplicate_each(DTwo(), from));
    }
  };
  struct Alternating {
    const Strip& s;
    std::size_t t;
    HWY_INLINE V16 load(const std::int16_t* values) const {
      return hn::BitCast(D(), alternate_two(DTwo(), values + t));
    }
  };
  static HWY_INLINE Duplicated queries(const Strip& s, std::size_t i) { return {s, i}; }
  static HWY_INLINE Alternating targets(const Strip& s, std::size_t t) { return {s, t}; }

  static HWY_INLINE V16 first_of_pair(V16 least, std::size_t i, std::size_t t) {
    return hn::Or(least, hn::LoadU(D(), upper_triangle.values + UpperTriangle::most - 2 * (t - i)));
  }

#if HWY_TARGET == HWY_AVX3_DL
  static HWY_INLINE auto ids(const std::uint32_t* ids, std::size_t first, std::size_t at) {
    const D32 d;
    const V32 of = hn::LoadU(d, ids + first), four = hn::LoadDup128(d, ids + at);
    const __m512i second_bit = _mm512_set1_epi32(2);
    constexpr int choose = 0xe4;  // bits of the first operand where the third is set, else of the
                                  // second
    return [=](V32 place, V32& query, V32& target) HWY_ATTR {
      // A place's lowest and highest bit are its target; the bits above do not matter.
      const __m512i step =
          _mm512_ternarylogic_epi32(hn::ShiftRight<4>(place).raw, place.raw, second_bit, choose);
      query = V32{_mm512_permutexvar_epi32(hn::ShiftRight<1>(place).raw, of.raw)};
      target = V32{_mm512_permutexvar_epi32(step, four.raw)};
    };
  }
#else
  static HWY_INLINE void ids(const std::uint32_t* ids, std::size_t first, std::size_t at,
                             unsigned from, std::uint32_t bits, V32& query, V32& target) {
    const D32 d;
    const hn::RepartitionToWide<D32> d64;
    const auto queries = duplicate_each(d64, ids + first + from % coordinate_lanes / 2);
    const auto targets = alternate_two(d64, ids + at + from / coordinate_lanes * 2);
    query = compress(hn::BitCast(d, queries), bits);
    target = compress(hn::BitCast(d, targets), bits);
  }
#endif
};

template <Orientation orientation>
class BroadcastSweep : public BlockSweep<orientation, BroadcastOrder> {
  using Block = BlockSweep<orientation, BroadcastOrder>;
  using Block::strip_, Block::hits_;

 public:
  using Block::Block;

  // Whether the queries [begin, end) are faster by this sweep.
  bool pays_off(std::uint32_t begin, std::uint32_t end) const {
    if (!broadcast_pays) return false;
    const D16 d;
    std::uint32_t sum = 0, count = 0;
    for (std::uint32_t i = begin; i < end; i += 2 * coordinate_lanes) {
      const auto upper = hn::LoadU(d, strip_.upper[0].data() + i);
      sum += end_of(hn::GetLane(hn::MaxOfLanes(d, upper))) - i;
      ++count;
    }
    return sum >= min_broadcast_window() * count;
  }

  // Sweeps the row of queries from `i` on. If only few have long windows, their rests are appended
  // to `unfinished`, relative to `block`.
  template <bool ordered>
  HWY_NOINLINE void run(std::uint32_t i, std::uint32_t block, Windows& unfinished) {
    const D16 d;
    const Strip s = strip_;  // a local copy: the compiler must assume that the stores may change
                             // the member
    const Queries<D16> queries(BroadcastOrder::queries(s, i));
    const std::uint32_t stop = end_of(hn::GetLane(hn::MaxOfLanes(d, queries.upper[0])));
    std::uint32_t t = i + 1;
    const std::uint32_t on_diagonal = std::min(stop, i + broadcast_queries);
    std::size_t hits_end = hits_.count;
    for (; t < on_diagonal; t += Block::targets_per_step)
      this->template test<ordered, true>(s, queries, i, t, hits_end);
    while (t < stop) {
      const std::uint32_t next_check = std::min(stop, t + check_interval);
      for (; t < next_check; t += Block::targets_per_step)
        this->template test<ordered, false>(s, queries, i, t, hits_end);
      if (t >= stop) break;
      const auto bucket = static_cast<std::int16_t>(s.bucket_start(t));
      std::uint32_t continuing = bits_of(d, hn::Not(hn::Gt(hn::Set(d, bucket), queries.upper[0])));
      if (static_cast<std::uint32_t>(std::popcount(continuing)) * min_continuing_share >=
          coordinate_lanes)
        continue;
      for (continuing &= 0x55555555u; continuing != 0; continuing &= continuing - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(continuing));
        unfinished.add(i - block + lane / 2, t);
      }
      break;
    }
    hits_.count = hits_end;
    this->vectors_ += (t - i - 1) / 2;
  }

 private:
  // After this many targets the row continues only if one in `min_continuing_share` of its queries
  // does: a single query takes as long per vector of targets as a row takes for six or eight
  // targets.
  static constexpr std::uint32_t check_interval = 32, min_continuing_share = 4;

  std::uint32_t end_of(std::int16_t upper) const {
    return strip_.bucket_end[std::min(strip_.bucket_of(upper), strip_.bucket_count - 1)];
  }
};

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
