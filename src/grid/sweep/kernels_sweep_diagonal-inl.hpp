// The sweep of a strip against itself along diagonals: a vector of queries i, i + 1, ... against
// targets i + k, i + k + 1, ... for k = 1, 2, ... Included once per instruction set.
//
// Needs no broadcasts, and a window may end at any target. Vectors have at most 16 coordinates:
// wider ones would wait for the longest of more windows, and most loads would cross a cache line.
#if defined(THRONG_KERNELS_SWEEP_DIAGONAL_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_SWEEP_DIAGONAL_INL
#undef THRONG_KERNELS_SWEEP_DIAGONAL_INL
#else
#define THRONG_KERNELS_SWEEP_DIAGONAL_INL
#endif

#include <hwy/highway.h>

#include <bit>

#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/kernels_box_test-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DQuery = hn::CappedTag<std::int16_t, 16>;
using VQuery = hn::Vec<DQuery>;
constexpr std::uint32_t diagonal_lanes = static_cast<std::uint32_t>(hn::MaxLanes(DQuery()));
constexpr std::size_t diagonal_steps = 4;  // targets per branch

struct QueryVector {
  VQuery upper0, upper1, upper2, lower0, lower1, lower2, query_reject_bits;
  HWY_INLINE QueryVector(const Strip& s, std::size_t i)
      : upper0(hn::LoadU(DQuery(), s.upper[0] + i)),
        upper1(hn::LoadU(DQuery(), s.upper[1] + i)),
        upper2(hn::LoadU(DQuery(), s.upper[2] + i)),
        lower0(hn::LoadU(DQuery(), s.lower[0] + i)),
        lower1(hn::LoadU(DQuery(), s.lower[1] + i)),
        lower2(hn::LoadU(DQuery(), s.lower[2] + i)),
        query_reject_bits(hn::LoadU(DQuery(), s.query_reject_bits + i)) {}

  // The least coordinate difference, as in compare(): 0 is a tie, below 0 is no overlap.
  template <bool ordered>
  HWY_INLINE VQuery least(const Strip& s, std::size_t t) const {
    const DQuery d;
    VQuery x = hn::Min(hn::Sub(upper0, hn::LoadU(d, s.lower[0] + t)),
                       hn::Sub(upper1, hn::LoadU(d, s.lower[1] + t)));
    VQuery y = hn::Min(hn::Sub(hn::LoadU(d, s.upper[1] + t), lower1),
                       hn::Sub(hn::LoadU(d, s.upper[2] + t), lower2));
    x = hn::Min(x, hn::Sub(upper2, hn::LoadU(d, s.lower[2] + t)));
    if constexpr (!ordered) y = hn::Min(y, hn::Sub(hn::LoadU(d, s.upper[0] + t), lower0));
    return hn::Min(x, y);
  }
  // Pairs that this column must not report: another one is the owner cell, or a filter forbids it.
  HWY_INLINE hn::Mask<DQuery> rejected(const Strip& s, std::size_t t) const {
    const DQuery d;
    return hn::Gt(hn::And(query_reject_bits, hn::LoadU(d, s.target_reject_bits + t)), hn::Zero(d));
  }
};

#if HWY_TARGET == HWY_AVX3_DL
// Returns the overlaps of the queries with `diagonal_steps` targets from `t` on, a bit per step and
// query. `ties`: some pairs may be ties; it may count ties that another cell owns.
template <bool ordered>
HWY_INLINE std::uint64_t compare_diagonal(const QueryVector& q, const Strip& s, std::size_t t,
                                          bool& ties) {
  const DQuery d;
  VQuery l[diagonal_steps];
  const hn::Repartition<std::uint16_t, DQuery> du;
  for (std::size_t k = 0; k < diagonal_steps; ++k) l[k] = q.least<ordered>(s, t + k);
  const auto overlaps = [&](std::size_t k) HWY_ATTR {
    const __m256i target_reject_bits = hn::LoadU(d, s.target_reject_bits + t + k).raw;
    return _mm256_mask_cmp_epi16_mask(
        _mm256_testn_epi16_mask(q.query_reject_bits.raw, target_reject_bits), l[k].raw,
        _mm256_setzero_si256(), _MM_CMPINT_NLE);
  };
  const auto bits = [&](std::size_t k) HWY_ATTR { return hn::BitCast(du, l[k]); };
  const auto closest = hn::Min(hn::Min(bits(0), bits(1)), hn::Min(bits(2), bits(3))).raw;
  ties = _mm256_testn_epi16_mask(closest, closest) != 0;
  return _mm512_kunpackd(_mm512_kunpackw(overlaps(3), overlaps(2)),
                         _mm512_kunpackw(overlaps(1), overlaps(0)));
}
#else
using D8 = hn::Repartition<std::int8_t, DQuery>;

template <bool ordered>
HWY_INLINE std::uint64_t compare_diagonal(const QueryVector& q, const Strip& s, std::size_t t,
                                          bool& ties) {
  const DQuery d;
  VQuery l[diagonal_steps];
  const D8 d8;
  const hn::Repartition<std::uint8_t, DQuery> du8;
  for (std::size_t k = 0; k < diagonal_steps; ++k) {
    l[k] = hn::Or(q.least<ordered>(s, t + k), hn::VecFromMask(d, q.rejected(s, t + k)));
  }
  const auto low = narrow(d8, l[0], l[1]), high = narrow(d8, l[2], l[3]);
  const auto closest = hn::Min(hn::BitCast(du8, low), hn::BitCast(du8, high));
  ties = !hn::AllFalse(du8, hn::Eq(closest, hn::Zero(du8)));
  const auto overlaps = [&](auto v) HWY_ATTR {
    return std::uint64_t{bits_of(d8, hn::Gt(v, hn::Zero(d8)))};
  };
  return overlaps(low) | overlaps(high) << 2 * diagonal_lanes;
}
#endif

template <Orientation orientation>
class DiagonalSweep {
 public:
  DiagonalSweep(const Strip& strip, Emit& out) : strip_(strip), out_(out) {}

  // Sweeps the queries [begin, end). If only few of a vector have long windows, their rests are
  // appended to `unfinished`, relative to `begin`; `unfinished_count` is the length of that list.
  template <bool ordered>
  void run(std::uint32_t begin, std::uint32_t end, Window* unfinished,
           std::uint32_t& unfinished_count);
  // Writes the pairs of all hits and of all ties.
  void write() {
    write<PairState::confirmed>(hits_);
    if (HWY_UNLIKELY(ties_.count != 0)) write<PairState::tie>(ties_);
  }
  std::uint64_t vectors() const { return vectors_; }

 private:
  // Queries continue together while that takes at most this many steps per query that continues.
  static constexpr std::size_t max_shared_steps = 32;

  template <bool ordered>
  void collect_ties(std::size_t first, std::size_t at);
  template <PairState state>
  void write(Hits& hits);

  const Strip& strip_;
  Emit& out_;
  std::uint64_t vectors_ = 0;
  Hits hits_, ties_;
};

// Collects ties for the floats to decide. Recomputes the differences; an array of them would be
// stored at every step, with or without ties.
template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE void DiagonalSweep<orientation>::collect_ties(std::size_t first, std::size_t at) {
  const DQuery d;
  const QueryVector q(strip_, first);
  const auto tied = [&](std::size_t k) HWY_ATTR {
    const auto not_rejected =
        hn::Eq(hn::And(q.query_reject_bits, hn::LoadU(d, strip_.target_reject_bits + at + k)),
               hn::Zero(d));
    const VQuery l = q.least<ordered>(strip_, at + k);
    return std::uint64_t{bits_of(d, hn::And(not_rejected, hn::Eq(l, hn::Zero(d))))}
           << k * diagonal_lanes;
  };
  ties_.add(first, at, tied(0) | tied(1) | tied(2) | tied(3));
  if (ties_.count == Hits::capacity) write<PairState::tie>(ties_);
}

template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE void DiagonalSweep<orientation>::run(std::uint32_t begin, std::uint32_t end,
                                                  Window* unfinished,
                                                  std::uint32_t& unfinished_count) {
  const DQuery d;
  const Strip s = strip_;
  const auto bucket_start = hn::Set(d, static_cast<std::int16_t>(-(1 << s.shift)));
  const std::size_t count = s.count;
  std::size_t hits_end = hits_.count;
  for (std::size_t i = begin; i < end; i += diagonal_lanes) {
    const QueryVector queries(s, i);
    std::size_t at = i + 1;
    for (;;) {
      bool ties;
      const std::uint64_t overlaps = compare_diagonal<ordered>(queries, s, at, ties);
      if (HWY_UNLIKELY(ties)) collect_ties<ordered>(i, at);
      hits_.add(i, at, overlaps, hits_end);
      if (HWY_UNLIKELY(hits_end == Hits::capacity)) {
        hits_.count = hits_end;
        write<PairState::confirmed>(hits_);
        hits_end = 0;
      }
      at += diagonal_steps;
      if (at >= count) break;
      const auto beyond =
          hn::Gt(hn::And(hn::LoadU(d, s.lower[0] + at), bucket_start), queries.upper0);
      if (hn::AllTrue(d, beyond)) break;
      if (HWY_LIKELY(at - i <= max_shared_steps)) continue;
      std::uint32_t continuing = bits_of(d, hn::Not(beyond));
      if (static_cast<std::size_t>(std::popcount(continuing)) * max_shared_steps >= at - i)
        continue;
      for (; continuing != 0; continuing &= continuing - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(continuing));
        unfinished[unfinished_count] = {static_cast<std::uint32_t>(i) - begin + lane,
                                        static_cast<std::uint32_t>(at) + lane};
        unfinished_count += at + lane < count;
      }
      break;
    }
    vectors_ += at - i - 1;
  }
  hits_.count = hits_end;
}

template <Orientation orientation>
template <PairState state>
HWY_NOINLINE void DiagonalSweep<orientation>::write(Hits& hits) {
  const D32 d;
  const std::uint32_t* HWY_RESTRICT ids = strip_.id;
#if HWY_TARGET == HWY_AVX3_DL
  const V32 lanes = hn::Set(d, diagonal_lanes - 1);
  write_pairs<orientation, state>(hits, out_, [&](std::size_t first, std::size_t at) HWY_ATTR {
    const V32 of = hn::LoadU(d, ids + first);
    const V32 low = hn::LoadU(d, ids + at), high = hn::LoadU(d, ids + at + diagonal_lanes);
    return [=](V32 place, V32& query, V32& target) HWY_ATTR {
      const V32 step = hn::Add(hn::And(place, lanes), hn::ShiftRight<4>(place));
      query = V32{_mm512_permutexvar_epi32(place.raw, of.raw)};
      target = V32{_mm512_permutex2var_epi32(low.raw, step.raw, high.raw)};
    };
  });
#else
  const auto pick = [&](std::size_t first, std::size_t at, unsigned from, std::uint32_t bits,
                        V32& query, V32& target) HWY_ATTR {
    const unsigned lane = from & (diagonal_lanes - 1), step = from / diagonal_lanes;
    query = compress(hn::LoadU(d, ids + first + lane), bits);
    target = compress(hn::LoadU(d, ids + at + lane + step), bits);
  };
  write_pairs<orientation, state>(hits, out_, pick);
#endif
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
