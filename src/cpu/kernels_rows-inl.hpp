// The sweep of a strip against itself where windows are long: a row of queries stays in registers,
// and two targets at a time are broadcast against it. Included once per instruction set.
#if defined(THRONG_KERNELS_ROWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_ROWS_INL
#undef THRONG_KERNELS_ROWS_INL
#else
#define THRONG_KERNELS_ROWS_INL
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "cpu/kernels_compare-inl.hpp"
#include "cpu/kernels_emit-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t row_queries = word_lanes / 2;
constexpr std::uint32_t row_steps = 4;                // vectors per branch,
constexpr std::uint32_t row_targets = 2 * row_steps;  // that is, targets per branch
// It does not pay with vectors of eight coordinates.
constexpr bool has_rows = word_lanes > 8;
// Broadcast is faster than the diagonal sweep (kernels_sides-inl.hpp) if the last window of a
// vector of queries ends at least this far after its first query. It wastes half of the comparisons
// of the first row_queries targets.
constexpr std::uint32_t rows_pay_from = word_lanes + 20;
// See core::plan. Fitted, like the number above, to runs over all scenes of the benchmark.
constexpr core::SweepCost sweep_cost =
    has_rows ? core::SweepCost{5, 0.5, 0.16, 4, 0.08} : core::SweepCost{5, 0.5, 0.2, 0.5, 0.2};

// Returns v0, v0, v1, v1, ... `wide` is the unsigned tag of twice the width.
template <class D, class T>
HWY_INLINE hn::Vec<D> each_twice(D wide, const T* values) {
  const hn::Rebind<T, D> half;
  const auto once = hn::PromoteTo(wide, hn::LoadU(half, values));
  return hn::Or(once, hn::ShiftLeft<8 * sizeof(T)>(once));
}
// Returns v0, v1, v0, v1, ...
template <class D, class T>
HWY_INLINE hn::Vec<D> two_by_turns(D wide, const T* values) {
  hn::TFromD<D> both;
  static_assert(sizeof both == 2 * sizeof(T));
  std::memcpy(&both, values, sizeof both);
  return hn::Set(wide, both);
}

// Half as many queries as lanes, each coordinate twice, because targets come in twos. With one
// query per lane the first targets would waste twice as many comparisons; and a 32-bit broadcast is
// one load, a 16-bit one on some processors a load and a shuffle.
struct Row {
  V16 upper0, upper1, upper2, lower0, lower1, lower2, asks;
  HWY_INLINE Row(const Strip& s, std::size_t i)
      : upper0(twice(s.upper[0] + i)),
        upper1(twice(s.upper[1] + i)),
        upper2(twice(s.upper[2] + i)),
        lower0(twice(s.lower[0] + i)),
        lower1(twice(s.lower[1] + i)),
        lower2(twice(s.lower[2] + i)),
        asks(twice(s.asks + i)) {}

  using DTwo = hn::Repartition<std::uint32_t, D16>;
  static HWY_INLINE V16 twice(const std::int16_t* words) {
    return hn::BitCast(D16(), each_twice(DTwo(), reinterpret_cast<const std::uint16_t*>(words)));
  }
  static HWY_INLINE V16 two(const std::int16_t* words) {
    return hn::BitCast(D16(), two_by_turns(DTwo(), words));
  }

  // The least coordinate difference, as in compare(): 0 is a tie, below 0 is no overlap.
  template <bool ordered>
  HWY_INLINE V16 least(const Strip& s, std::size_t t) const {
    V16 x = hn::Min(hn::Sub(upper0, two(s.lower[0] + t)), hn::Sub(upper1, two(s.lower[1] + t)));
    V16 y = hn::Min(hn::Sub(two(s.upper[1] + t), lower1), hn::Sub(two(s.upper[2] + t), lower2));
    x = hn::Min(x, hn::Sub(upper2, two(s.lower[2] + t)));
    if constexpr (!ordered) y = hn::Min(y, hn::Sub(two(s.upper[0] + t), lower0));
    return hn::Min(x, y);
  }
};

// Masks the pairs whose query does not precede the target, by making their difference negative.
// Load from `words` + `most` - 2 * (first target - first query).
struct NotBefore {
  static constexpr std::uint32_t most = 2 * (row_queries + row_targets);
  std::int16_t words[most + word_lanes] = {};
  constexpr NotBefore() {
    for (std::uint32_t k = most; k < most + word_lanes; ++k) words[k] = -32767;
    words[most + 1] = 0;  // the first of two precedes the second
  }
};
inline constexpr NotBefore not_before;

template <Orientation orientation>
class RowByRow {
 public:
  RowByRow(const Strip& strip, Emit& out) : strip_(strip), out_(out) {}

  // Whether the queries [begin, end) are faster by this sweep.
  bool pay(std::uint32_t begin, std::uint32_t end) const;
  // Sweeps the row of queries from `i` on. If only few have long windows, their rests are appended
  // to `rest`, relative to `block`; `left` is the length of that list.
  template <bool ordered>
  void run(std::uint32_t i, std::uint32_t block, Window* rest, std::uint32_t& left);
  // Writes the pairs of all hits and of all ties.
  void write() {
    write<Sure::yes>(hits_);
    if (HWY_UNLIKELY(ties_.count != 0)) write<Sure::no>(ties_);
  }
  std::uint64_t vectors() const { return vectors_; }

 private:
  // After this many targets the row continues only if one in `least_share` of its queries does: a
  // single query takes as long per vector of targets as a row takes for six or eight targets.
  static constexpr std::uint32_t patience = 32, least_share = 4;

  std::uint32_t end_of(std::int16_t upper) const {
    return strip_.bucket_end[std::min(strip_.bucket_of(upper), strip_.bucket_count - 1)];
  }
  template <bool ordered, bool corner>
  void compare(const Strip& s, const Row& queries, std::size_t i, std::size_t t,
               std::size_t& hits_end);
  void defer(V16 l0, V16 l1, V16 l2, V16 l3, std::size_t i, std::size_t t);
  template <Sure sure>
  void write(Hits& hits);

  const Strip& strip_;
  Emit& out_;
  std::uint64_t vectors_ = 0;
  Hits hits_, ties_;
};

template <Orientation orientation>
bool RowByRow<orientation>::pay(std::uint32_t begin, std::uint32_t end) const {
  if (!has_rows) return false;
  const D16 d;
  std::uint32_t sum = 0, count = 0;
  for (std::uint32_t i = begin; i < end; i += 2 * word_lanes) {
    sum += end_of(hn::GetLane(hn::MaxOfLanes(d, hn::LoadU(d, strip_.upper[0] + i)))) - i;
    ++count;
  }
  return sum >= rows_pay_from * count;
}

// Collects ties for the floats to decide. The differences come in registers; an array of them would
// be stored at every step, with or without ties.
template <Orientation orientation>
HWY_NOINLINE void RowByRow<orientation>::defer(V16 l0, V16 l1, V16 l2, V16 l3, std::size_t i,
                                               std::size_t t) {
  const D16 d;
  const V16 asks = Row::twice(strip_.asks + i);
  const auto tied = [&](V16 l, std::size_t k) HWY_ATTR {
    const auto home = hn::Eq(hn::And(asks, Row::two(strip_.begins + t + 2 * k)), hn::Zero(d));
    return std::uint64_t{bits_of(d, hn::And(home, hn::Eq(l, hn::Zero(d))))} << k * word_lanes % 64;
  };
  const std::uint64_t low = tied(l0, 0) | tied(l1, 1), high = tied(l2, 2) | tied(l3, 3);
  if constexpr (word_lanes == 32) {
    ties_.add(i, t, low);
    ties_.add(i, t + row_targets / 2, high);
  } else {
    ties_.add(i, t, low | high);
  }
  if (ties_.count >= Hits::room - 1) write<Sure::no>(ties_);
}

// `corner`: some of these targets are queries of the row.
template <Orientation orientation>
template <bool ordered, bool corner>
HWY_INLINE void RowByRow<orientation>::compare(const Strip& s, const Row& queries, std::size_t i,
                                               std::size_t t, std::size_t& hits_end) {
  const D16 d;
  const auto least = [&](std::size_t k) HWY_ATTR {
    const V16 l = queries.least<ordered>(s, t + 2 * k);
    if constexpr (!corner) return l;
    return hn::Or(l, hn::LoadU(d, not_before.words + NotBefore::most - 2 * (t + 2 * k - i)));
  };
#if HWY_TARGET == HWY_AVX3_DL
  const V16 l0 = least(0), l1 = least(1), l2 = least(2), l3 = least(3);
  const auto met = [&](V16 l, std::size_t k) HWY_ATTR {
    const V16 begins = Row::two(s.begins + t + 2 * k);
    return _mm512_mask_cmp_epi16_mask(_mm512_testn_epi16_mask(queries.asks.raw, begins.raw), l.raw,
                                      _mm512_setzero_si512(), _MM_CMPINT_NLE);
  };
  const __m512i closest =
      _mm512_min_epu16(_mm512_min_epu16(l0.raw, l1.raw), _mm512_min_epu16(l2.raw, l3.raw));
  const bool ties = _mm512_testn_epi16_mask(closest, closest) != 0;
  hits_.add(i, t, _mm512_kunpackd(met(l1, 1), met(l0, 0)), hits_end);
  hits_.add(i, t + 4, _mm512_kunpackd(met(l3, 3), met(l2, 2)), hits_end);
#else
  const hn::Repartition<std::int8_t, D16> d8;
  const hn::Repartition<std::uint8_t, D16> du8;
  const auto at_home = [&](std::size_t k) HWY_ATTR {
    const V16 both = hn::And(queries.asks, Row::two(s.begins + t + 2 * k));
    return hn::Or(least(k), hn::VecFromMask(d, hn::Gt(both, hn::Zero(d))));
  };
  const V16 l0 = at_home(0), l1 = at_home(1), l2 = at_home(2), l3 = at_home(3);
  const auto low = narrow(d8, l0, l1), high = narrow(d8, l2, l3);
  const auto closest = hn::Min(hn::BitCast(du8, low), hn::BitCast(du8, high));
  const bool ties = !hn::AllFalse(du8, hn::Eq(closest, hn::Zero(du8)));
  const auto met = [&](auto v)
                       HWY_ATTR { return std::uint64_t{bits_of(d8, hn::Gt(v, hn::Zero(d8)))}; };
  hits_.add(i, t, met(low) | met(high) << 2 * word_lanes, hits_end);
#endif
  if (HWY_UNLIKELY(ties)) defer(l0, l1, l2, l3, i, t);
  if (HWY_UNLIKELY(hits_end >= Hits::room - 1)) {
    hits_.count = hits_end;
    write<Sure::yes>(hits_);
    hits_end = 0;
  }
}

template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE void RowByRow<orientation>::run(std::uint32_t i, std::uint32_t block, Window* rest,
                                             std::uint32_t& left) {
  const D16 d;
  const Strip s = strip_;  // a local copy: the compiler must assume that the stores may change the
                           // member
  const Row queries(s, i);
  const std::uint32_t stop = end_of(hn::GetLane(hn::MaxOfLanes(d, queries.upper0)));
  std::uint32_t t = i + 1;
  const std::uint32_t corner = std::min(stop, i + row_queries);
  std::size_t hits_end = hits_.count;
  for (; t < corner; t += row_targets) compare<ordered, true>(s, queries, i, t, hits_end);
  while (t < stop) {
    const std::uint32_t pause = std::min(stop, t + patience);
    for (; t < pause; t += row_targets) compare<ordered, false>(s, queries, i, t, hits_end);
    if (t >= stop) break;
    const auto bucket = static_cast<std::int16_t>(s.lower[0][t] & -(1 << s.shift));
    std::uint32_t going = bits_of(d, hn::Not(hn::Gt(hn::Set(d, bucket), queries.upper0)));
    if (static_cast<std::uint32_t>(std::popcount(going)) * least_share >= word_lanes) continue;
    for (going &= 0x55555555u; going != 0; going &= going - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(going));
      rest[left++] = {i - block + lane / 2, t};
    }
    break;
  }
  hits_.count = hits_end;
  vectors_ += (t - i - 1) / 2;
}

template <Orientation orientation>
template <Sure sure>
HWY_NOINLINE void RowByRow<orientation>::write(Hits& hits) {
  const D32 d;
  const std::uint32_t* HWY_RESTRICT ids = strip_.id;
#if HWY_TARGET == HWY_AVX3_DL
  const __m512i second_bit = _mm512_set1_epi32(2);
  constexpr int choose = 0xe4;  // bits of the first operand where the third is set, else of the
                                // second
  write_pairs<orientation, sure>(hits, out_, [&](std::size_t first, std::size_t at) HWY_ATTR {
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
    const auto queries = each_twice(d64, ids + first + from % word_lanes / 2);
    const auto targets = two_by_turns(d64, ids + at + from / word_lanes * 2);
    query = compress(hn::BitCast(d, queries), bits);
    target = compress(hn::BitCast(d, targets), bits);
  };
  write_pairs<orientation, sure>(hits, out_, pick);
#endif
}

}  // namespace throng::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
