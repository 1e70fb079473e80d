// Transposes a strip's records into arrays of coordinates. Included once per instruction set.
#if defined(THRONG_KERNELS_TRANSPOSE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_TRANSPOSE_INL
#undef THRONG_KERNELS_TRANSPOSE_INL
#else
#define THRONG_KERNELS_TRANSPOSE_INL
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// See Kernels::quantized_range.
inline void quantized_range(const Record* records, std::uint32_t count, std::uint32_t axis,
                            std::uint32_t* least, std::uint32_t* most) {
  const hn::ScalableTag<std::uint16_t> d;
  constexpr std::uint32_t group = static_cast<std::uint32_t>(hn::MaxLanes(d)) / 8;
  const auto at = [&](std::uint32_t i) HWY_ATTR {
    return hn::LoadU(d, reinterpret_cast<const std::uint16_t*>(records + i));
  };
  std::uint32_t low = *least, high = *most, i = 0;
  if (count >= group) {
    auto lows = at(0), highs = lows;
    for (i = group; i + group <= count; i += group) {
      const auto r = at(i);
      lows = hn::Min(lows, r);
      highs = hn::Max(highs, r);
    }
    std::uint16_t words[2][hn::MaxLanes(d)];
    hn::StoreU(lows, d, words[0]);
    hn::StoreU(highs, d, words[1]);
    for (std::uint32_t r = 0; r < group; ++r) {
      low = std::min<std::uint32_t>(low, words[0][8 * r + axis]);
      high = std::max<std::uint32_t>(high, words[1][8 * r + axis]);
    }
  }
  for (; i < count; ++i) {
    low = std::min<std::uint32_t>(low, records[i].lower[axis]);
    high = std::max<std::uint32_t>(high, records[i].lower[axis]);
  }
  *least = low;
  *most = high;
}

// A vector of records: 128-bit block b holds record b * step.
template <std::size_t step, class D>
HWY_INLINE hn::Vec<D> load_records(D d, const Record* const* r) {
  using T = hn::TFromD<D>;
  constexpr std::size_t records = hn::MaxLanes(D()) * sizeof(T) / sizeof(Record);
  if constexpr (records == 1) {
    return hn::LoadU(d, reinterpret_cast<const T*>(*r));
  } else {
    const hn::Half<D> dh;
    return hn::Combine(d, load_records<step>(dh, r + records / 2 * step),
                       load_records<step>(dh, r));
  }
}

inline void transpose(Strip& strip) {
  const hn::ScalableTag<std::uint16_t> d;
  using V = hn::Vec<decltype(d)>;
  constexpr std::uint32_t lanes = static_cast<std::uint32_t>(hn::MaxLanes(d));
  const std::uint32_t axes[3] = {strip.axis, (strip.axis + 1) % 3, (strip.axis + 2) % 3};
  const auto words = [](std::int16_t* array) { return reinterpret_cast<std::uint16_t*>(array); };
  V shortest = hn::Set(d, base::max_quantized);
  for (std::uint32_t i = 0; i < strip.count; i += lanes) {
    const Record* const* r = strip.record.data() + i;
    const auto v = [&](std::uint32_t k) HWY_ATTR { return load_records<8>(d, r + k); };
    const auto v0 = v(0), v1 = v(1), v2 = v(2), v3 = v(3), v4 = v(4), v5 = v(5), v6 = v(6),
               v7 = v(7);
    // Three rounds of interleaving transpose 8 x 8 values in each block.
    const auto a0 = hn::InterleaveLower(d, v0, v4), a1 = hn::InterleaveLower(d, v1, v5),
               a2 = hn::InterleaveLower(d, v2, v6), a3 = hn::InterleaveLower(d, v3, v7),
               a4 = hn::InterleaveUpper(d, v0, v4), a5 = hn::InterleaveUpper(d, v1, v5),
               a6 = hn::InterleaveUpper(d, v2, v6), a7 = hn::InterleaveUpper(d, v3, v7);
    const auto b0 = hn::InterleaveLower(d, a0, a2), b1 = hn::InterleaveLower(d, a1, a3),
               b2 = hn::InterleaveUpper(d, a0, a2), b3 = hn::InterleaveUpper(d, a1, a3),
               b4 = hn::InterleaveLower(d, a4, a6), b5 = hn::InterleaveLower(d, a5, a7),
               b6 = hn::InterleaveUpper(d, a4, a6), b7 = hn::InterleaveUpper(d, a5, a7);
    // Records hold lower 0, 1, 2, upper 0, 1, 2, and the two halves of the id.
    const V lower[3] = {hn::InterleaveLower(d, b0, b1), hn::InterleaveUpper(d, b0, b1),
                        hn::InterleaveLower(d, b2, b3)};
    const V upper[3] = {hn::InterleaveUpper(d, b2, b3), hn::InterleaveLower(d, b4, b5),
                        hn::InterleaveUpper(d, b4, b5)};
    V mask = hn::Zero(d);
    for (int k = 0; k < 3; ++k) {
      const V bit = hn::Set(d, static_cast<std::uint16_t>(1 << k));
      mask = hn::Or(mask, hn::IfThenElseZero(hn::Eq(lower[k], hn::Zero(d)), bit));
      hn::StoreU(lower[axes[k]], d, words(strip.lower[k].data() + i));
      hn::StoreU(upper[axes[k]], d, words(strip.upper[k].data() + i));
    }
    hn::StoreU(mask, d, reinterpret_cast<std::uint16_t*>(strip.target_mask.data() + i));
    hn::StoreInterleaved2(hn::InterleaveLower(d, b6, b7), hn::InterleaveUpper(d, b6, b7), d,
                          reinterpret_cast<std::uint16_t*>(strip.id.data() + i));
    shortest = hn::Min(shortest, hn::Sub(upper[axes[0]], lower[axes[0]]));
  }
  std::uint16_t lengths[lanes];
  hn::StoreU(shortest, d, lengths);
  strip.long_boxes = *std::min_element(lengths, lengths + lanes) >> strip.shift != 0;
  static_assert(Strip::padding % lanes == 0);
  const V top = hn::Set(d, base::max_quantized), none = hn::Set(d, 0xffff);
  for (std::uint32_t i = strip.count; i < strip.count + Strip::padding; i += lanes) {
    for (int k = 0; k < 3; ++k) {
      hn::StoreU(top, d, words(strip.lower[k].data() + i));
      hn::StoreU(none, d, words(strip.upper[k].data() + i));
    }
    hn::StoreU(hn::Zero(d), d, reinterpret_cast<std::uint16_t*>(strip.target_mask.data() + i));
  }
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
