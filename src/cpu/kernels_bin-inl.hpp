// Binning and transposing over vectors. Included once an instruction set.
#if defined(THRONG_KERNELS_BIN_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_BIN_INL
#undef THRONG_KERNELS_BIN_INL
#else
#define THRONG_KERNELS_BIN_INL
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cstring>

#include "cpu/kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// One corner of each of a vector's worth of boxes, a block of 128 bits each; the fourth lane is
// whatever follows in memory.
template <class D>
HWY_INLINE hn::Vec<D> load_corners(D d, const char* corner, std::size_t stride) {
  if constexpr (hn::MaxLanes(D()) == 4) {
    return hn::LoadU(d, reinterpret_cast<const float*>(corner));
  } else {
    const hn::Half<D> dh;
    return hn::Combine(d, load_corners(dh, corner + hn::MaxLanes(D()) / 8 * stride, stride),
                       load_corners(dh, corner, stride));
  }
}

// The lower and the upper corners of a vector's worth of boxes.
template <class D>
HWY_INLINE void load_boxes(D d, const char* boxes, std::size_t stride, hn::Vec<D>& lower,
                           hn::Vec<D>& upper) {
#if HWY_TARGET == HWY_AVX3
  if (stride == 24) {
    // Four boxes are 24 floats: two loads, and each corner picked from both.
    const __m512 a = _mm512_loadu_ps(boxes), b = _mm512_loadu_ps(boxes + 32);
    const __m512i pick_lower =
        _mm512_setr_epi32(0, 1, 2, 3, 6, 7, 8, 9, 12, 13, 14, 15, 26, 27, 28, 29);
    const __m512i pick_upper =
        _mm512_setr_epi32(3, 4, 5, 5, 9, 10, 11, 11, 15, 24, 25, 25, 29, 30, 31, 31);
    lower = hn::Vec<D>{_mm512_permutex2var_ps(a, pick_lower, b)};
    upper = hn::Vec<D>{_mm512_permutex2var_ps(a, pick_upper, b)};
    return;
  }
#endif
  lower = load_corners(d, boxes, stride);
  upper = load_corners(d, boxes + 12, stride);
}

// Truncation. What comes is within 0 .. 2^28, so that none of the care for other values is needed.
template <class D>
HWY_INLINE hn::Vec<D> to_index(D d, hn::VFromD<hn::RebindToFloat<D>> x) {
#if HWY_TARGET == HWY_AVX3
  (void)d;
  return hn::Vec<D>{_mm512_cvttps_epi32(x.raw)};
#elif HWY_TARGET == HWY_AVX2
  (void)d;
  return hn::Vec<D>{_mm256_cvttps_epi32(x.raw)};
#else
  return hn::ConvertTo(d, x);
#endif
}

// `four` repeated in each block.
template <class D, class T>
HWY_INLINE hn::Vec<D> in_each_block(D d, const T* four) {
  return hn::LoadDup128(d, four);
}

inline void bin(const core::Quantiser& map, const char* boxes, std::size_t stride,
                const std::uint32_t* ids, std::uint32_t first_id, std::uint32_t count,
                BinTarget& out) {
  const hn::ScalableTag<float> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::RebindToUnsigned<decltype(df)> du;
  const hn::Repartition<std::uint8_t, decltype(df)> db;
  const hn::Repartition<std::uint16_t, decltype(df)> dw;
  const std::uint32_t group = static_cast<std::uint32_t>(hn::Lanes(df)) / 4;

  const auto origin = in_each_block(df, map.origin);
  const auto scale = in_each_block(df, map.scale);
  const auto most = in_each_block(df, map.max);
  const auto stride_of = in_each_block(du, map.stride);
  alignas(16) static constexpr std::uint8_t lower_bytes[16] = {
      0, 1, 4, 5, 8, 9, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128};
  alignas(16) static constexpr std::uint8_t upper_bytes[16] = {
      128, 128, 128, 128, 128, 128, 0, 1, 4, 5, 8, 9, 128, 128, 128, 128};
  alignas(16) static constexpr std::uint16_t least_words[8] = {1, 1, 1, 1, 1, 1, 0, 0};
  // The fourth lane's indices are 0, whatever it is shifted by.
  alignas(16) static constexpr std::uint32_t span_shifts[4] = {span_shift(0), span_shift(1),
                                                               span_shift(2), 30};
  alignas(16) static constexpr std::uint32_t invalid_units[4] = {invalid_number, invalid_number,
                                                                 invalid_number, 0};
  const auto take_lower = in_each_block(db, lower_bytes);
  const auto take_upper = in_each_block(db, upper_bytes);
  const auto least = in_each_block(dw, least_words);
  const auto span_by = in_each_block(du, span_shifts);
  const auto invalid_unit = in_each_block(du, invalid_units);
  const auto three = hn::Set(du, 3);
  // Ids in the fourth lane of each block.
  const auto position = hn::Iota(du, 0);
  const auto is_fourth = hn::Eq(hn::And(position, three), three);
  auto id =
      hn::IfThenElseZero(is_fourth, hn::Add(hn::Set(du, first_id), hn::ShiftRight<2>(position)));
  const auto id_step = hn::IfThenElseZero(is_fourth, hn::Set(du, group));

  for (std::uint32_t i = 0; i < count; i += group) {
    hn::Vec<decltype(df)> lower, upper;
    load_boxes(df, boxes, stride, lower, upper);
    boxes += group * stride;
    const auto tl = hn::Mul(hn::Sub(lower, origin), scale);
    const auto tu = hn::Mul(hn::Sub(upper, origin), scale);
    const auto ql = to_index(di, hn::Min(hn::Max(tl, hn::Zero(df)), most));
    const auto qu = to_index(di, hn::Min(hn::Max(tu, hn::Zero(df)), most));
    hn::StoreU(ql, di, out.lower[i]);
    hn::StoreU(qu, di, out.upper[i]);
    const auto cl = hn::BitCast(du, hn::ShiftRight<16>(ql));
    const auto cu = hn::BitCast(du, hn::ShiftRight<16>(qu));
    auto number = hn::Mul(cl, stride_of);
    number = hn::Add(number, hn::Shl(hn::Min(hn::Sub(cu, cl), three), span_by));
    number =
        hn::Add(number, hn::IfThenZeroElse(hn::RebindMask(du, hn::Le(lower, upper)), invalid_unit));
    number = hn::Add(number, hn::Shuffle1032(number));
    number = hn::Add(number, hn::Shuffle2301(number));
    hn::StoreU(number, du, out.number[i]);
    const auto words = hn::Or(hn::TableLookupBytesOr0(hn::BitCast(db, ql), take_lower),
                              hn::TableLookupBytesOr0(hn::BitCast(db, qu), take_upper));
    const auto record = hn::Or(hn::Max(hn::BitCast(dw, words), least), hn::BitCast(dw, id));
    hn::StoreU(record, dw, reinterpret_cast<std::uint16_t*>(out.record + i));
    id = hn::Add(id, id_step);
  }
  if (ids) {
    for (std::uint32_t i = 0; i < count; ++i) out.record[i].id = ids[i];
  }

  // Every box is copied to where its column's next record goes; an odd one stays invisible there.
  const hn::FixedTag<std::uint32_t, 4> d4;
  std::uintptr_t* const tails = out.tail;
  const std::uintptr_t block_mask = out.block_mask;
  std::uint32_t odd_count = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t number = out.number[i][0];
    // Of an odd box too the low bits are a column of the grid: no branch to guess wrong.
    const std::uint32_t odd = number >= most_columns;
    const std::uint32_t column = number & (most_columns - 1);
    std::uintptr_t tail = tails[column];
    if (HWY_UNLIKELY((tail & block_mask) == 0)) tail = out.next_block(&out, column);
    std::uint32_t* to = reinterpret_cast<std::uint32_t*>(tail);
    hn::StoreU(hn::Load(d4, reinterpret_cast<const std::uint32_t*>(out.record + i)), d4, to);
    hwy::Prefetch(to + 32);
    out.odd[odd_count] = i;
    odd_count += odd;
    tails[column] = tail + sizeof(Record) * (1 - odd);
  }
  out.odd_count = odd_count;
}

// Vector k of a group of records: in block b of 128 bits the record b * 8 + k.
template <class D>
HWY_INLINE hn::Vec<D> load_blocks(D d, const Record* r) {
  if constexpr (hn::MaxLanes(D()) == 8) {
    return hn::LoadU(d, reinterpret_cast<const std::uint16_t*>(r));
  } else {
    const hn::Half<D> dh;
    return hn::Combine(d, load_blocks(dh, r + hn::MaxLanes(D()) / 2), load_blocks(dh, r));
  }
}

inline void word_range(const Record* records, std::uint32_t count, std::uint32_t axis,
                       std::uint32_t* least, std::uint32_t* most) {
  const hn::FixedTag<std::uint16_t, 8> d;
  const auto at = [&](std::uint32_t i) HWY_ATTR {
    return hn::LoadU(d, reinterpret_cast<const std::uint16_t*>(records + i));
  };
  if (count == 0) return;
  auto low = at(0), high = low;
  auto low2 = low, high2 = low;
  std::uint32_t i = 1;
  for (; i + 1 < count; i += 2) {
    low = hn::Min(low, at(i));
    high = hn::Max(high, at(i));
    low2 = hn::Min(low2, at(i + 1));
    high2 = hn::Max(high2, at(i + 1));
  }
  if (i < count) {
    low = hn::Min(low, at(i));
    high = hn::Max(high, at(i));
  }
  std::uint16_t words[8];
  hn::StoreU(hn::Min(low, low2), d, words);
  if (words[axis] < *least) *least = words[axis];
  hn::StoreU(hn::Max(high, high2), d, words);
  if (words[axis] > *most) *most = words[axis];
}

inline void transpose(Strip& strip) {
  const Record* sorted = strip.record;
  const std::uint32_t axis = strip.axis;
  const hn::ScalableTag<std::uint16_t> d;
  const std::uint32_t lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  const std::uint32_t axes[3] = {axis, (axis + 1) % 3, (axis + 2) % 3};
  for (std::uint32_t i = 0; i < strip.count; i += lanes) {
    const Record* r = sorted + i;
    const auto v0 = load_blocks(d, r), v1 = load_blocks(d, r + 1), v2 = load_blocks(d, r + 2),
               v3 = load_blocks(d, r + 3), v4 = load_blocks(d, r + 4), v5 = load_blocks(d, r + 5),
               v6 = load_blocks(d, r + 6), v7 = load_blocks(d, r + 7);
    // Three rounds of interleaving transpose 8 x 8 words in each block.
    const auto a0 = hn::InterleaveLower(d, v0, v4), a1 = hn::InterleaveLower(d, v1, v5),
               a2 = hn::InterleaveLower(d, v2, v6), a3 = hn::InterleaveLower(d, v3, v7),
               a4 = hn::InterleaveUpper(d, v0, v4), a5 = hn::InterleaveUpper(d, v1, v5),
               a6 = hn::InterleaveUpper(d, v2, v6), a7 = hn::InterleaveUpper(d, v3, v7);
    const auto b0 = hn::InterleaveLower(d, a0, a2), b1 = hn::InterleaveLower(d, a1, a3),
               b2 = hn::InterleaveUpper(d, a0, a2), b3 = hn::InterleaveUpper(d, a1, a3),
               b4 = hn::InterleaveLower(d, a4, a6), b5 = hn::InterleaveLower(d, a5, a7),
               b6 = hn::InterleaveUpper(d, a4, a6), b7 = hn::InterleaveUpper(d, a5, a7);
    // Records hold lower 0, 1, 2, upper 0, 1, 2, and the two halves of the id.
    const hn::Vec<decltype(d)> lower[3] = {hn::InterleaveLower(d, b0, b1),
                                           hn::InterleaveUpper(d, b0, b1),
                                           hn::InterleaveLower(d, b2, b3)};
    const hn::Vec<decltype(d)> upper[3] = {hn::InterleaveUpper(d, b2, b3),
                                           hn::InterleaveLower(d, b4, b5),
                                           hn::InterleaveUpper(d, b4, b5)};
    for (int k = 0; k < 3; ++k) {
      hn::StoreU(lower[axes[k]], d, strip.lower[k] + i);
      hn::StoreU(upper[axes[k]], d, strip.upper[k] + i);
    }
    hn::StoreInterleaved2(hn::InterleaveLower(d, b6, b7), hn::InterleaveUpper(d, b6, b7), d,
                          reinterpret_cast<std::uint16_t*>(strip.id + i));
  }
  for (std::uint32_t i = strip.count; i < strip.count + strip_padding; i += 8) {
    const hn::FixedTag<std::uint16_t, 8> d8;
    const std::uint32_t at =
        i + 8 <= strip.count + strip_padding ? i : strip.count + strip_padding - 8;
    for (int k = 0; k < 3; ++k) {
      hn::StoreU(hn::Set(d8, 65535), d8, strip.lower[k] + at);
      hn::StoreU(hn::Zero(d8), d8, strip.upper[k] + at);
    }
  }
}

}  // namespace throng::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
