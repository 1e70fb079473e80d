// The overlap test of two boxes over vectors of quantized coordinates. Every sweep uses it: they
// differ in which boxes they compare, and in what order. Included once per instruction set.
#if defined(THRONG_KERNELS_BOX_TEST_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_BOX_TEST_INL
#undef THRONG_KERNELS_BOX_TEST_INL
#else
#define THRONG_KERNELS_BOX_TEST_INL
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/strip.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE const std::int16_t* words(const RejectMask* masks) {
  return reinterpret_cast<const std::int16_t*>(masks);
}

// Vectors of boxes of a strip, one box per lane. The classes below differ in the box of each lane;
// a sweep adds others. `lower` and `upper` load one coordinate where it is used.
template <class Tag>
struct ConsecutiveBoxes {  // i, i + 1, i + 2, ...
  using D = Tag;
  const Strip& s;
  std::size_t i;
  HWY_INLINE hn::Vec<D> load(const std::int16_t* values) const {
    return hn::LoadU(D(), values + i);
  }
};
template <class Boxes>
HWY_INLINE auto lower_of(const Boxes& b, int k) {
  return b.load(b.s.lower[k].data());
}
template <class Boxes>
HWY_INLINE auto upper_of(const Boxes& b, int k) {
  return b.load(b.s.upper[k].data());
}
template <class Boxes>
HWY_INLINE auto target_mask_of(const Boxes& b) {
  return b.load(words(b.s.target_mask.data()));
}

// The queries of several vectors of pairs, in registers. Axis 0 is the sweep axis.
template <class D>
struct Queries {
  hn::Vec<D> lower[3], upper[3], mask;
  template <class Boxes>
  HWY_INLINE explicit Queries(const Boxes& b)
      : lower{lower_of(b, 0), lower_of(b, 1), lower_of(b, 2)},
        upper{upper_of(b, 0), upper_of(b, 1), upper_of(b, 2)},
        mask(b.load(words(b.s.query_mask.data()))) {}
};

// QuantizedBox::least_difference() of each pair. `ordered`: no target ends before its query starts
// on the sweep axis.
//
// No difference leaves the range of int16, padding included: its lower coordinates are 32767, its
// upper ones -1, so the least is -1 - 32767. A pair with padding is below 0: no overlap, no tie.
template <bool ordered, class Q, class Targets>
HWY_INLINE auto least_difference(const Q& q, const Targets& t) {
  auto x = hn::Min(hn::Sub(q.upper[0], lower_of(t, 0)), hn::Sub(q.upper[1], lower_of(t, 1)));
  auto y = hn::Min(hn::Sub(upper_of(t, 1), q.lower[1]), hn::Sub(upper_of(t, 2), q.lower[2]));
  x = hn::Min(x, hn::Sub(q.upper[2], lower_of(t, 2)));
  if constexpr (!ordered) y = hn::Min(y, hn::Sub(upper_of(t, 0), q.lower[0]));
  return hn::Min(x, y);
}

#if HWY_TARGET == HWY_AVX3_DL
HWY_INLINE __mmask32 overlap_mask(__m512i least, __m512i query_mask, __m512i target_mask) {
  return _mm512_mask_cmp_epi16_mask(_mm512_testn_epi16_mask(query_mask, target_mask), least,
                                    _mm512_setzero_si512(), _MM_CMPINT_NLE);
}
HWY_INLINE __mmask16 overlap_mask(__m256i least, __m256i query_mask, __m256i target_mask) {
  return _mm256_mask_cmp_epi16_mask(_mm256_testn_epi16_mask(query_mask, target_mask), least,
                                    _mm256_setzero_si256(), _MM_CMPINT_NLE);
}
HWY_INLINE bool any_zero(__m512i v) { return _mm512_testn_epi16_mask(v, v) != 0; }
HWY_INLINE bool any_zero(__m256i v) { return _mm256_testn_epi16_mask(v, v) != 0; }
HWY_INLINE __mmask32 tie_mask(__m512i least, __m512i query_mask, __m512i target_mask) {
  return _mm512_mask_testn_epi16_mask(_mm512_testn_epi16_mask(query_mask, target_mask), least,
                                      least);
}
HWY_INLINE __mmask16 tie_mask(__m256i least, __m256i query_mask, __m256i target_mask) {
  return _mm256_mask_testn_epi16_mask(_mm256_testn_epi16_mask(query_mask, target_mask), least,
                                      least);
}
#endif

// Of one vector of pairs, a bit per pair that overlaps and is not rejected; of `ties`, that ties.
template <class D>
HWY_INLINE std::uint32_t overlaps_of_vector(D d, hn::Vec<D> least, hn::Vec<D> query_mask,
                                            hn::Vec<D> target_mask, std::uint32_t& ties) {
#if HWY_TARGET == HWY_AVX3_DL
  (void)d;
  ties = tie_mask(least.raw, query_mask.raw, target_mask.raw);
  return overlap_mask(least.raw, query_mask.raw, target_mask.raw);
#else
  const auto zero = hn::Zero(d);
  const auto allowed = hn::Eq(hn::And(query_mask, target_mask), zero);
  const auto tied = hn::And(allowed, hn::Eq(least, zero));
  ties = HWY_LIKELY(hn::AllFalse(d, tied)) ? 0 : bits_of(d, tied);
  return bits_of(d, hn::And(allowed, hn::Gt(least, zero)));
#endif
}

// The same of four vectors of pairs, with one branch: whether there may be a tie among them.
template <class D>
struct FourVectors {
  static constexpr std::size_t lanes = hn::MaxLanes(D());
  static constexpr std::size_t words = (4 * lanes + 63) / 64;
  hn::Vec<D> l0, l1, l2, l3;  // least differences; of a rejected pair perhaps another value below 0
  std::uint64_t overlaps[words];
  bool ties;  // also if a tie is rejected
};

#if HWY_TARGET == HWY_AVX3_DL

// least(k) and target_mask(k): of vector k.
template <class D, class Least, class Mask>
HWY_INLINE FourVectors<D> overlaps_of_four(D d, const Least& least, hn::Vec<D> query_mask,
                                           const Mask& target_mask) {
  FourVectors<D> four{least(0), least(1), least(2), least(3), {}, false};
  const auto mask = [&](auto l, std::size_t k) HWY_ATTR {
    return overlap_mask(l.raw, query_mask.raw, target_mask(k).raw);
  };
  const hn::Repartition<std::uint16_t, D> du;
  const auto bits = [&](auto l) HWY_ATTR { return hn::BitCast(du, l); };
  four.ties = any_zero(
      hn::Min(hn::Min(bits(four.l0), bits(four.l1)), hn::Min(bits(four.l2), bits(four.l3))).raw);
  if constexpr (FourVectors<D>::words == 2) {
    four.overlaps[0] = _mm512_kunpackd(mask(four.l1, 1), mask(four.l0, 0));
    four.overlaps[1] = _mm512_kunpackd(mask(four.l3, 3), mask(four.l2, 2));
  } else {
    four.overlaps[0] = _mm512_kunpackd(_mm512_kunpackw(mask(four.l3, 3), mask(four.l2, 2)),
                                       _mm512_kunpackw(mask(four.l1, 1), mask(four.l0, 0)));
  }
  (void)d;
  return four;
}

#else

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

template <class D, class Least, class Mask>
HWY_INLINE FourVectors<D> overlaps_of_four(D d, const Least& least, hn::Vec<D> query_mask,
                                           const Mask& target_mask) {
  static_assert(FourVectors<D>::words == 1, "wider vectors need a form of their own");
  const hn::Repartition<std::int8_t, D> d8;
  const hn::Repartition<std::uint8_t, D> du8;
  // A rejected pair is below 0.
  const auto masked = [&](std::size_t k) HWY_ATTR {
    const auto rejected = hn::Gt(hn::And(query_mask, target_mask(k)), hn::Zero(d));
    return hn::Or(least(k), hn::VecFromMask(d, rejected));
  };
  FourVectors<D> four{masked(0), masked(1), masked(2), masked(3), {}, false};
  const auto low = narrow(d8, four.l0, four.l1), high = narrow(d8, four.l2, four.l3);
  const auto closest = hn::Min(hn::BitCast(du8, low), hn::BitCast(du8, high));
  const auto overlaps = [&](auto v) HWY_ATTR {
    return std::uint64_t{bits_of(d8, hn::Gt(v, hn::Zero(d8)))};
  };
  four.ties = !hn::AllFalse(du8, hn::Eq(closest, hn::Zero(du8)));
  four.overlaps[0] = overlaps(low) | overlaps(high) << 2 * FourVectors<D>::lanes;
  return four;
}

#endif

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
