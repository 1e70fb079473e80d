// The sweep of a strip against itself where windows are long: a row of queries stays in registers,
// and two targets at a time are broadcast against it. Included once per instruction
// set.
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

#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/kernels_box_test-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t broadcast_queries = quantized_lanes / 2;
constexpr std::uint32_t broadcast_steps = 4;                      // vectors per branch,
constexpr std::uint32_t broadcast_targets = 2 * broadcast_steps;  // that is, targets per branch
// It does not pay with vectors of eight coordinates.
constexpr bool broadcast_pays = quantized_lanes > 8;
// Broadcast is faster than the diagonal sweep (kernels_sweep_diagonal-inl.hpp) if the last window
// of a vector of queries ends at least this far after its first query. It wastes half of the
// comparisons of the first broadcast_queries targets.
constexpr std::uint32_t min_broadcast_window = quantized_lanes + 20;
// See base::plan. Fitted, like the number above, to runs over all scenes of the benchmark.
constexpr SweepCost sweep_cost =
    broadcast_pays ? SweepCost{5, 0.5, 0.16, 4, 0.08} : SweepCost{5, 0.5, 0.2, 0.5, 0.2};

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

// Half as many queries as lanes, each coordinate twice, because targets come in twos.
// With one query per lane the first targets would waste twice as many comparisons; and a
// 32-bit broadcast is one load, a 16-bit one on some processors a load and a shuffle.
struct QueryRow {
  V16 upper0, upper1, upper2, lower0, lower1, lower2, query_reject_bits;
  HWY_INLINE QueryRow(const Strip& s, std::size_t i)
      : upper0(load_duplicated(s.upper[0] + i)),
        upper1(load_duplicated(s.upper[1] + i)),
        upper2(load_duplicated(s.upper[2] + i)),
        lower0(load_duplicated(s.lower[0] + i)),
        lower1(load_duplicated(s.lower[1] + i)),
        lower2(load_duplicated(s.lower[2] + i)),
        query_reject_bits(load_duplicated(s.query_reject_bits + i)) {}

  using DTwo = hn::Repartition<std::uint32_t, D16>;
  static HWY_INLINE V16 load_duplicated(const std::int16_t* words) {
    return hn::BitCast(D16(),
                       duplicate_each(DTwo(), reinterpret_cast<const std::uint16_t*>(words)));
  }
  static HWY_INLINE V16 load_alternating(const std::int16_t* words) {
    return hn::BitCast(D16(), alternate_two(DTwo(), words));
  }

  // The least coordinate difference, as in compare(): 0 is a tie, below 0 is no overlap.
  template <bool ordered>
  HWY_INLINE V16 least(const Strip& s, std::size_t t) const {
    V16 x = hn::Min(hn::Sub(upper0, load_alternating(s.lower[0] + t)),
                    hn::Sub(upper1, load_alternating(s.lower[1] + t)));
    V16 y = hn::Min(hn::Sub(load_alternating(s.upper[1] + t), lower1),
                    hn::Sub(load_alternating(s.upper[2] + t), lower2));
    x = hn::Min(x, hn::Sub(upper2, load_alternating(s.lower[2] + t)));
    if constexpr (!ordered) y = hn::Min(y, hn::Sub(load_alternating(s.upper[0] + t), lower0));
    return hn::Min(x, y);
  }
};

// Masks the pairs whose query does not precede the target, by making their difference negative.
// Load from `words` + `most` - 2 * (first target - first query).
struct UpperTriangleMask {
  static constexpr std::uint32_t most = 2 * (broadcast_queries + broadcast_targets);
  std::int16_t words[most + quantized_lanes] = {};
  constexpr UpperTriangleMask() {
    for (std::uint32_t k = most; k < most + quantized_lanes; ++k) words[k] = -32767;
    words[most + 1] = 0;  // the first of two precedes the second
  }
};
inline constexpr UpperTriangleMask upper_triangle_mask;

template <Orientation orientation>
class BroadcastSweep {
 public:
  BroadcastSweep(const Strip& strip, Emit& out) : strip_(strip), out_(out) {}

  // Whether the queries [begin, end) are faster by this sweep.
  bool pays_off(std::uint32_t begin, std::uint32_t end) const;
  // Sweeps the row of queries from `i` on. If only few have long windows, their rests are appended
  // to `unfinished`, relative to `block`; `unfinished_count` is the length of that list.
  template <bool ordered>
  void run(std::uint32_t i, std::uint32_t block, Window* unfinished,
           std::uint32_t& unfinished_count);
  // Writes the pairs of all hits and of all ties.
  void write() {
    write<PairState::confirmed>(hits_);
    if (HWY_UNLIKELY(ties_.count != 0)) write<PairState::tie>(ties_);
  }
  std::uint64_t vectors() const { return vectors_; }

 private:
  // After this many targets the row continues only if one in `min_continuing_share` of its queries
  // does: a single query takes as long per vector of targets as a row takes for six or eight
  // targets.
  static constexpr std::uint32_t check_interval = 32, min_continuing_share = 4;

  std::uint32_t end_of(std::int16_t upper) const {
    return strip_.bucket_end[std::min(strip_.bucket_of(upper), strip_.bucket_count - 1)];
  }
  template <bool ordered, bool on_diagonal>
  void compare(const Strip& s, const QueryRow& queries, std::size_t i, std::size_t t,
               std::size_t& hits_end);
  void collect_ties(V16 l0, V16 l1, V16 l2, V16 l3, std::size_t i, std::size_t t);
  template <PairState state>
  void write(Hits& hits);

  const Strip& strip_;
  Emit& out_;
  std::uint64_t vectors_ = 0;
  Hits hits_, ties_;
};

template <Orientation orientation>
bool BroadcastSweep<orientation>::pays_off(std::uint32_t begin, std::uint32_t end) const {
  if (!broadcast_pays) return false;
  const D16 d;
  std::uint32_t sum = 0, count = 0;
  for (std::uint32_t i = begin; i < end; i += 2 * quantized_lanes) {
    sum += end_of(hn::GetLane(hn::MaxOfLanes(d, hn::LoadU(d, strip_.upper[0] + i)))) - i;
    ++count;
  }
  return sum >= min_broadcast_window * count;
}

// Collects ties for the floats to decide. The differences come in registers; an array of them would
// be stored at every step, with or without ties.
template <Orientation orientation>
HWY_NOINLINE void BroadcastSweep<orientation>::collect_ties(V16 l0, V16 l1, V16 l2, V16 l3,
                                                            std::size_t i, std::size_t t) {
  const D16 d;
  const V16 query_reject_bits = QueryRow::load_duplicated(strip_.query_reject_bits + i);
  const auto tied = [&](V16 l, std::size_t k) HWY_ATTR {
    const auto not_rejected =
        hn::Eq(hn::And(query_reject_bits,
                       QueryRow::load_alternating(strip_.target_reject_bits + t + 2 * k)),
               hn::Zero(d));
    return std::uint64_t{bits_of(d, hn::And(not_rejected, hn::Eq(l, hn::Zero(d))))}
           << k * quantized_lanes % 64;
  };
  const std::uint64_t low = tied(l0, 0) | tied(l1, 1), high = tied(l2, 2) | tied(l3, 3);
  if constexpr (quantized_lanes == 32) {
    ties_.add(i, t, low);
    ties_.add(i, t + broadcast_targets / 2, high);
  } else {
    ties_.add(i, t, low | high);
  }
  if (ties_.count >= Hits::capacity - 1) write<PairState::tie>(ties_);
}

// `on_diagonal`: some of these targets are queries of the row.
template <Orientation orientation>
template <bool ordered, bool on_diagonal>
HWY_INLINE void BroadcastSweep<orientation>::compare(const Strip& s, const QueryRow& queries,
                                                     std::size_t i, std::size_t t,
                                                     std::size_t& hits_end) {
  const D16 d;
  const auto least = [&](std::size_t k) HWY_ATTR {
    const V16 l = queries.least<ordered>(s, t + 2 * k);
    if constexpr (!on_diagonal) return l;
    return hn::Or(
        l, hn::LoadU(d, upper_triangle_mask.words + UpperTriangleMask::most - 2 * (t + 2 * k - i)));
  };
#if HWY_TARGET == HWY_AVX3_DL
  const V16 l0 = least(0), l1 = least(1), l2 = least(2), l3 = least(3);
  const auto overlaps = [&](V16 l, std::size_t k) HWY_ATTR {
    const V16 target_reject_bits = QueryRow::load_alternating(s.target_reject_bits + t + 2 * k);
    return _mm512_mask_cmp_epi16_mask(
        _mm512_testn_epi16_mask(queries.query_reject_bits.raw, target_reject_bits.raw), l.raw,
        _mm512_setzero_si512(), _MM_CMPINT_NLE);
  };
  const __m512i closest =
      _mm512_min_epu16(_mm512_min_epu16(l0.raw, l1.raw), _mm512_min_epu16(l2.raw, l3.raw));
  const bool ties = _mm512_testn_epi16_mask(closest, closest) != 0;
  hits_.add(i, t, _mm512_kunpackd(overlaps(l1, 1), overlaps(l0, 0)), hits_end);
  hits_.add(i, t + 4, _mm512_kunpackd(overlaps(l3, 3), overlaps(l2, 2)), hits_end);
#else
  const hn::Repartition<std::int8_t, D16> d8;
  const hn::Repartition<std::uint8_t, D16> du8;
  const auto masked_least = [&](std::size_t k) HWY_ATTR {
    const V16 both = hn::And(queries.query_reject_bits,
                             QueryRow::load_alternating(s.target_reject_bits + t + 2 * k));
    return hn::Or(least(k), hn::VecFromMask(d, hn::Gt(both, hn::Zero(d))));
  };
  const V16 l0 = masked_least(0), l1 = masked_least(1), l2 = masked_least(2), l3 = masked_least(3);
  const auto low = narrow(d8, l0, l1), high = narrow(d8, l2, l3);
  const auto closest = hn::Min(hn::BitCast(du8, low), hn::BitCast(du8, high));
  const bool ties = !hn::AllFalse(du8, hn::Eq(closest, hn::Zero(du8)));
  const auto overlaps = [&](auto v) HWY_ATTR {
    return std::uint64_t{bits_of(d8, hn::Gt(v, hn::Zero(d8)))};
  };
  hits_.add(i, t, overlaps(low) | overlaps(high) << 2 * quantized_lanes, hits_end);
#endif
  if (HWY_UNLIKELY(ties)) collect_ties(l0, l1, l2, l3, i, t);
  if (HWY_UNLIKELY(hits_end >= Hits::capacity - 1)) {
    hits_.count = hits_end;
    write<PairState::confirmed>(hits_);
    hits_end = 0;
  }
}

template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE void BroadcastSweep<orientation>::run(std::uint32_t i, std::uint32_t block,
                                                   Window* unfinished,
                                                   std::uint32_t& unfinished_count) {
  const D16 d;
  const Strip s = strip_;  // a local copy: the compiler must assume that the stores may change the
                           // member
  const QueryRow queries(s, i);
  const std::uint32_t stop = end_of(hn::GetLane(hn::MaxOfLanes(d, queries.upper0)));
  std::uint32_t t = i + 1;
  const std::uint32_t on_diagonal = std::min(stop, i + broadcast_queries);
  std::size_t hits_end = hits_.count;
  for (; t < on_diagonal; t += broadcast_targets)
    compare<ordered, true>(s, queries, i, t, hits_end);
  while (t < stop) {
    const std::uint32_t next_check = std::min(stop, t + check_interval);
    for (; t < next_check; t += broadcast_targets)
      compare<ordered, false>(s, queries, i, t, hits_end);
    if (t >= stop) break;
    const auto bucket = static_cast<std::int16_t>(s.lower[0][t] & -(1 << s.shift));
    std::uint32_t continuing = bits_of(d, hn::Not(hn::Gt(hn::Set(d, bucket), queries.upper0)));
    if (static_cast<std::uint32_t>(std::popcount(continuing)) * min_continuing_share >=
        quantized_lanes)
      continue;
    for (continuing &= 0x55555555u; continuing != 0; continuing &= continuing - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(continuing));
      unfinished[unfinished_count++] = {i - block + lane / 2, t};
    }
    break;
  }
  hits_.count = hits_end;
  vectors_ += (t - i - 1) / 2;
}

template <Orientation orientation>
template <PairState state>
HWY_NOINLINE void BroadcastSweep<orientation>::write(Hits& hits) {
  const D32 d;
  const std::uint32_t* HWY_RESTRICT ids = strip_.id;
#if HWY_TARGET == HWY_AVX3_DL
  const __m512i second_bit = _mm512_set1_epi32(2);
  constexpr int choose = 0xe4;  // bits of the first operand where the third is set, else of the
                                // second
  write_pairs<orientation, state>(hits, out_, [&](std::size_t first, std::size_t at) HWY_ATTR {
    const V32 of = hn::LoadU(d, ids + first), four = hn::LoadDup128(d, ids + at);
    return [=](V32 place, V32& query, V32& target) HWY_ATTR {
      // A place's lowest and highest bit are its target; the bits above do not matter.
      const __m512i step =
          _mm512_ternarylogic_epi32(hn::ShiftRight<4>(place).raw, place.raw, second_bit, choose);
      query = V32{_mm512_permutexvar_epi32(hn::ShiftRight<1>(place).raw, of.raw)};
      target = V32{_mm512_permutexvar_epi32(step, four.raw)};
    };
  });
#else
  const hn::RepartitionToWide<D32> d64;
  const auto pick = [&](std::size_t first, std::size_t at, unsigned from, std::uint32_t bits,
                        V32& query, V32& target) HWY_ATTR {
    const auto queries = duplicate_each(d64, ids + first + from % quantized_lanes / 2);
    const auto targets = alternate_two(d64, ids + at + from / quantized_lanes * 2);
    query = compress(hn::BitCast(d, queries), bits);
    target = compress(hn::BitCast(d, targets), bits);
  };
  write_pairs<orientation, state>(hits, out_, pick);
#endif
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
