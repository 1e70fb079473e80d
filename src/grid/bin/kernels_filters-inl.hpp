// Filter classes: which combination of filters each box has. Included once per instruction set.
#if defined(THRONG_KERNELS_FILTERS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_FILTERS_INL
#undef THRONG_KERNELS_FILTERS_INL
#else
#define THRONG_KERNELS_FILTERS_INL
#endif

#include <hwy/highway.h>

#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

inline bool match_filter_classes(const FilterTile& tile, const FilterCombination* known,
                                 std::uint32_t known_count, std::uint8_t* filter_classes) {
  const hn::ScalableTag<std::uint32_t> d;
  const hn::RebindToSigned<decltype(d)> signed_d;
  const hn::Rebind<std::uint8_t, decltype(d)> bytes;
  constexpr std::uint32_t lanes = static_cast<std::uint32_t>(hn::MaxLanes(d));
  const auto nothing = hn::Set(d, unknown_class);
  auto missed = hn::Zero(d);
  for (std::uint32_t i = 0; i < filter_tile; i += lanes) {
    const auto group = hn::LoadU(d, tile.group + i), mask = hn::LoadU(d, tile.mask + i);
    const auto moves = hn::Eq(hn::PromoteTo(d, hn::LoadU(bytes, tile.is_static + i)), hn::Zero(d));
    const auto is_static = hn::IfThenZeroElse(moves, hn::Set(d, 1));
    auto filter_class = nothing;
    for (std::uint32_t k = 0; k < known_count; ++k) {
      const auto differ = hn::Or(hn::Or(hn::Xor(group, hn::Set(d, known[k].group)),
                                        hn::Xor(mask, hn::Set(d, known[k].mask))),
                                 hn::Xor(is_static, hn::Set(d, known[k].is_static)));
      filter_class = hn::IfThenElse(hn::Eq(differ, hn::Zero(d)), hn::Set(d, k), filter_class);
    }
    missed = hn::Max(missed, filter_class);
    hn::StoreU(hn::DemoteTo(bytes, hn::BitCast(signed_d, filter_class)), bytes, filter_classes + i);
  }
  return hn::AllFalse(d, hn::Eq(missed, nothing));
}

inline void read_worlds(const std::int32_t* worlds, std::uint32_t count, WorldRange& range) {
  const hn::ScalableTag<std::int32_t> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  constexpr std::uint32_t lanes = static_cast<std::uint32_t>(hn::MaxLanes(d));
  const auto in_all_worlds = hn::Set(d, -1);
  auto least = hn::Set(du, range.least);
  auto greatest = hn::Set(d, range.greatest), sum = hn::Zero(d);
  for (std::uint32_t i = 0; i < filter_tile; i += lanes) {
    const auto world = hn::LoadU(d, worlds + i);
    least = hn::Min(least, hn::BitCast(du, world));
    greatest = hn::Max(greatest, world);
    sum = hn::Sub(sum, hn::VecFromMask(d, hn::Eq(world, in_all_worlds)));
  }
  range.least = hn::GetLane(hn::MinOfLanes(du, least));
  range.greatest = hn::GetLane(hn::MaxOfLanes(d, greatest));
  range.in_all_worlds += static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(d, sum)));
  for (std::uint32_t i = count; i < filter_tile; ++i)
    range.in_all_worlds -= worlds[i] == -1 ? 1 : 0;
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
