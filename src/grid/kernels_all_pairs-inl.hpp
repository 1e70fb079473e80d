// Brute force over vectors. Included once per instruction set.
#if defined(THRONG_KERNELS_ALL_PAIRS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_ALL_PAIRS_INL
#undef THRONG_KERNELS_ALL_PAIRS_INL
#else
#define THRONG_KERNELS_ALL_PAIRS_INL
#endif

#include <hwy/highway.h>

#include <bit>

#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <Orientation orientation>
void all_pairs_as(const Tile& q, const Tile& t, bool same, PairOutput& out) {
  const hn::ScalableTag<float> d;
  const std::uint32_t lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  PairWriter<orientation> pairs(out);
  for (std::uint32_t i = 0; i < q.count; ++i) {
    const auto l0 = hn::Set(d, q.corner[0][i]), l1 = hn::Set(d, q.corner[1][i]),
               l2 = hn::Set(d, q.corner[2][i]), u0 = hn::Set(d, q.corner[3][i]),
               u1 = hn::Set(d, q.corner[4][i]), u2 = hn::Set(d, q.corner[5][i]);
    const std::uint32_t first = same ? i + 1 : 0;
    for (std::uint32_t j = first; j < t.count; j += lanes) {
      const auto x = hn::And(hn::Le(l0, hn::LoadU(d, t.corner[3].data() + j)),
                             hn::Le(hn::LoadU(d, t.corner[0].data() + j), u0));
      const auto y = hn::And(hn::Le(l1, hn::LoadU(d, t.corner[4].data() + j)),
                             hn::Le(hn::LoadU(d, t.corner[1].data() + j), u1));
      const auto z = hn::And(hn::Le(l2, hn::LoadU(d, t.corner[5].data() + j)),
                             hn::Le(hn::LoadU(d, t.corner[2].data() + j), u2));
      const auto inside = hn::FirstN(d, t.count - j);
      const std::uint32_t bits = bits_of(d, hn::And(hn::And(x, y), hn::And(z, inside)));
      if (bits == 0) continue;
      const auto target = compress(hn::LoadU(D32(), t.id + j), bits);
      pairs.put(hn::Set(D32(), q.id[i]), target, std::popcount(bits));
    }
    if (t.count > first) out.comparisons += t.count - first;
  }
}

inline void all_pairs(const Tile& q, const Tile& t, bool same, Orientation orientation,
                      PairOutput& out) {
  switch (orientation) {
    case Orientation::unordered:
      return all_pairs_as<Orientation::unordered>(q, t, same, out);
    case Orientation::query_first:
      return all_pairs_as<Orientation::query_first>(q, t, same, out);
    case Orientation::target_first:
      return all_pairs_as<Orientation::target_first>(q, t, same, out);
  }
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
