// The overlap test of one box against a vector of boxes, on quantized coordinates. Included once
// per instruction set.
#if defined(THRONG_KERNELS_BOX_TEST_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_BOX_TEST_INL
#undef THRONG_KERNELS_BOX_TEST_INL
#else
#define THRONG_KERNELS_BOX_TEST_INL
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t quantized_lanes = static_cast<std::uint32_t>(hn::MaxLanes(D16()));

// Queries are processed in blocks, so that a block's lists stay in the L1 cache.
constexpr std::uint32_t query_block = 256;

// A box as a query: each coordinate twice, so that one 32-bit load broadcasts it. Axis 0 is the
// sweep axis.
struct Query {
  std::uint32_t upper0, lower1, upper1, lower2;
  std::uint32_t upper2, lower0, id, query_reject_bits;
};
static_assert(sizeof(Query) == 32);

HWY_INLINE V16 spread(const std::uint32_t& doubled) {
  return hn::BitCast(D16(), hn::Set(hn::Repartition<std::uint32_t, D16>(), doubled));
}

// The coordinates of a vector of targets.
struct Targets {
  V16 lower0, upper0, lower1, upper1, lower2, upper2, target_reject_bits;
  HWY_INLINE Targets(const Strip& s, std::size_t k)
      : lower0(hn::LoadU(D16(), s.lower[0] + k)),
        upper0(hn::LoadU(D16(), s.upper[0] + k)),
        lower1(hn::LoadU(D16(), s.lower[1] + k)),
        upper1(hn::LoadU(D16(), s.upper[1] + k)),
        lower2(hn::LoadU(D16(), s.lower[2] + k)),
        upper2(hn::LoadU(D16(), s.upper[2] + k)),
        target_reject_bits(hn::LoadU(D16(), s.target_reject_bits + k)) {}
};

// The rest of a query's window: the query's index in its block, and the next target.
struct Window {
  std::uint32_t query, at;
};

#if HWY_TARGET != HWY_AVX3_DL
// Packs a, then b, to bytes of the same sign; zero stays zero. `d` is the byte tag.
template <class D, class V>
HWY_INLINE hn::Vec<D> narrow(D d, V a, V b) {
#if HWY_TARGET == HWY_AVX2
  (void)d;
  return hn::Vec<D>{_mm256_permute4x64_epi64(_mm256_packs_epi16(a.raw, b.raw), 0xd8)};
#else
  const hn::Half<D> half;
  return hn::Combine(d, hn::DemoteTo(half, b), hn::DemoteTo(half, a));
#endif
}
#endif

// Returns a bit per target that overlaps the query by quantized coordinates and has this column as
// the pair's owner cell. `tie` is the subset with an equal coordinate. `ordered`: no target ends
// before the query starts on the sweep axis.
//
// Padding never matches: its upper coordinates are -1. A lower coordinate minus -1 is above 0, so
// `below` is above 0; or it is 32768, which wraps to -32768 and stays so when negated. No other
// difference leaves the range of int16.
template <bool ordered>
HWY_INLINE std::uint32_t compare(const Query& q, const Targets& t, std::uint32_t& tie) {
  const D16 d;
  const V16 zero = hn::Zero(d);
  const V16 above =
      hn::Min(hn::Min(hn::Sub(spread(q.upper0), t.lower0), hn::Sub(spread(q.upper1), t.lower1)),
              hn::Sub(spread(q.upper2), t.lower2));
  V16 below = hn::Max(hn::Sub(spread(q.lower1), t.upper1), hn::Sub(spread(q.lower2), t.upper2));
  if constexpr (!ordered) below = hn::Max(below, hn::Sub(spread(q.lower0), t.upper0));
  const V16 least = hn::Min(above, hn::Sub(zero, below));
#if HWY_TARGET == HWY_AVX3_DL
  const __mmask32 not_rejected =
      _mm512_testn_epi16_mask(spread(q.query_reject_bits).raw, t.target_reject_bits.raw);
  const __mmask32 overlaps =
      _mm512_mask_cmp_epi16_mask(not_rejected, least.raw, zero.raw, _MM_CMPINT_NLT);
  tie = _mm512_mask_testn_epi16_mask(overlaps, least.raw, least.raw);
  return overlaps;
#else
  const auto not_rejected =
      hn::Eq(hn::And(spread(q.query_reject_bits), t.target_reject_bits), zero);
  const auto tied = hn::And(not_rejected, hn::Eq(least, zero));
  tie = HWY_LIKELY(hn::AllFalse(d, tied)) ? 0 : bits_of(d, tied);
  return bits_of(d, hn::And(not_rejected, hn::Gt(least, hn::Set(d, -1))));
#endif
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
