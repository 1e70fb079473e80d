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

#include "base/cost_table.hpp"
#include "grid/sweep/kernels_sweep_block-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

struct DiagonalOrder {
  using D = hn::CappedTag<std::int16_t, 16>;
  static constexpr std::uint32_t lanes = static_cast<std::uint32_t>(hn::MaxLanes(D()));
  static constexpr std::size_t targets_per_vector = 1;

  static HWY_INLINE ConsecutiveBoxes<D> queries(const Strip& s, std::size_t i) { return {s, i}; }
  static HWY_INLINE ConsecutiveBoxes<D> targets(const Strip& s, std::size_t t) { return {s, t}; }

#if HWY_TARGET == HWY_AVX3_DL
  static HWY_INLINE auto ids(const std::uint32_t* ids, std::size_t first, std::size_t at) {
    const D32 d;
    const V32 of = hn::LoadU(d, ids + first);
    const V32 low = hn::LoadU(d, ids + at), high = hn::LoadU(d, ids + at + lanes);
    const V32 lane_bits = hn::Set(d, lanes - 1);
    return [=](V32 place, V32& query, V32& target) HWY_ATTR {
      const V32 ahead = hn::Add(hn::And(place, lane_bits), hn::ShiftRight<4>(place));
      query = V32{_mm512_permutexvar_epi32(place.raw, of.raw)};
      target = V32{_mm512_permutex2var_epi32(low.raw, ahead.raw, high.raw)};
    };
  }
#else
  static HWY_INLINE void ids(const std::uint32_t* ids, std::size_t first, std::size_t at,
                             unsigned from, std::uint32_t bits, V32& query, V32& target) {
    const unsigned lane = from & (lanes - 1), step = from / lanes;
    query = compress(hn::LoadU(D32(), ids + first + lane), bits);
    target = compress(hn::LoadU(D32(), ids + at + lane + step), bits);
  }
#endif
};

template <Orientation orientation>
class DiagonalSweep : public BlockSweep<orientation, DiagonalOrder> {
  using Block = BlockSweep<orientation, DiagonalOrder>;
  using Block::lanes, Block::strip_, Block::hits_;

 public:
  using Block::Block;

  // Sweeps the queries [begin, end). If only few of a vector have long windows, their rests are
  // appended to `unfinished`, relative to `begin`.
  template <bool ordered>
  HWY_NOINLINE void run(std::uint32_t begin, std::uint32_t end, Windows& unfinished) {
    const D d;
    const Strip s = strip_;  // a local copy: the compiler must assume that the stores may change
                             // the member
    const auto bucket_start = hn::Set(d, static_cast<std::int16_t>(-(1 << s.shift)));
    // Queries continue together while that takes at most this many steps per query that continues.
    const auto max_shared_steps = static_cast<std::size_t>(base::cost.shared_steps);
    std::size_t hits_end = hits_.count;
    for (std::size_t i = begin; i < end; i += lanes) {
      const Queries<D> queries(DiagonalOrder::queries(s, i));
      std::size_t at = i + 1;
      for (;;) {
        this->template test<ordered, false>(s, queries, i, at, hits_end);
        at += Block::targets_per_step;
        if (at >= s.count) break;
        const auto beyond =
            hn::Gt(hn::And(hn::LoadU(d, s.lower[0].data() + at), bucket_start), queries.upper[0]);
        if (hn::AllTrue(d, beyond)) break;
        if (HWY_LIKELY(at - i <= max_shared_steps)) continue;
        std::uint32_t continuing = bits_of(d, hn::Not(beyond));
        if (static_cast<std::size_t>(std::popcount(continuing)) * max_shared_steps >= at - i)
          continue;
        for (; continuing != 0; continuing &= continuing - 1) {
          const auto lane = static_cast<std::uint32_t>(std::countr_zero(continuing));
          unfinished.add(i - begin + lane, at + lane, at + lane < s.count);
        }
        break;
      }
      this->vectors_ += at - i - 1;
    }
    hits_.count = hits_end;
  }

 private:
  using D = DiagonalOrder::D;
};

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
