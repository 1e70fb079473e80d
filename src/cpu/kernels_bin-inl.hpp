// Binning over vectors. Included once an instruction set.
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
#include "cpu/prefetch.hpp"

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

// Truncation. What comes is within 0 .. 2^27, so that none of the care for other values is needed.
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

using Words = hn::Vec<hn::FixedTag<std::uint16_t, 8>>;
HWY_INLINE Words load_record(const Record* r) {
  return hn::Load(hn::FixedTag<std::uint16_t, 8>(), reinterpret_cast<const std::uint16_t*>(r));
}
HWY_INLINE void store_record(std::uintptr_t to, Words record) {
  hn::StoreU(record, hn::FixedTag<std::uint16_t, 8>(), reinterpret_cast<std::uint16_t*>(to));
  prefetch_to_own(reinterpret_cast<const char*>(to) + 128);
}

// Which words of a record a copy in a later column changes: for each set of axes along which it
// lies one column further, those of the upper corner, which are the true ones there, and those of
// the lower corner, which are 0.
struct CopyMasks {
  alignas(16) std::uint16_t upper[8][8] = {};
  alignas(16) std::uint16_t lower[8][8] = {};
  constexpr CopyMasks() {
    for (int axes = 0; axes < 8; ++axes) {
      for (int k = 0; k < 3; ++k) {
        upper[axes][3 + k] = lower[axes][k] = (axes >> k & 1) ? 0xffff : 0;
      }
    }
  }
};

// Enters boxes that touch a second column along some axes into the other 1, 3 or 7 columns. They
// are sorted by those axes first, so that what is done for each is known without a branch.
HWY_NOINLINE void copy_on(const core::Quantiser& map, const std::uint8_t* several,
                          std::uint32_t count, BinTarget& out) {
  static constexpr CopyMasks masks;
  const hn::FixedTag<std::uint16_t, 8> d;
  // 0: those left to the caller.
  std::uint8_t lists[8][bin_tile];
  std::uint32_t counts[8] = {};
  for (std::uint32_t s = 0; s < count; ++s) {
    const std::uint32_t axes = out.number[several[s]][0] >> column_bits;
    const std::uint32_t list = axes < 8 ? axes : 0;
    lists[list][counts[list]++] = several[s];
  }
  for (std::uint32_t s = 0; s < counts[0]; ++s) out.odd[s] = lists[0][s];
  out.odd_count = counts[0];
  for (std::uint32_t axes = 1; axes < 8; ++axes) {
    if (counts[axes] == 0) continue;
    for (std::uint32_t part = axes; part != 0; part = (part - 1) & axes) {
      const auto upper = hn::MaskFromVec(hn::Load(d, masks.upper[part]));
      const auto lower = hn::Load(d, masks.lower[part]);
      std::uint32_t delta = 0;
      for (int k = 0; k < 3; ++k) delta += (part >> k & 1) ? map.stride[k] : 0;
      for (std::uint32_t s = 0; s < counts[axes]; ++s) {
        const std::uint32_t i = lists[axes][s];
        const std::uint32_t column = (out.number[i][0] & (most_columns - 1)) + delta;
        const Words record =
            hn::IfThenElse(upper, load_record(out.whole + i), load_record(out.record + i));
        const std::uintptr_t tail = out.room(column);
        store_record(tail, hn::AndNot(lower, record));
        out.tail[column] = tail + sizeof(Record);
      }
    }
  }
}

// Boxes are asked for so far ahead: docs/benchmarks.md tells what that is worth.
constexpr std::size_t ahead_bytes = 3072;

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
  alignas(16) static constexpr std::uint32_t next_units[4] = {1u << column_bits, 2u << column_bits,
                                                              4u << column_bits, 0};
  alignas(16) static constexpr std::uint32_t invalid_units[4] = {invalid_number, invalid_number,
                                                                 invalid_number, 0};
  const auto take_lower = in_each_block(db, lower_bytes);
  const auto take_upper = in_each_block(db, upper_bytes);
  const auto least = in_each_block(dw, least_words);
  const auto next_unit = in_each_block(du, next_units);
  const auto further_unit = hn::Set(du, further_number);
  const auto invalid_unit = in_each_block(du, invalid_units);
  const auto one = hn::Set(di, 1);
  const auto three = hn::Set(du, 3);
  const auto low_part = hn::Set(dw, core::top_word);
  const auto top = hn::Set(di, core::top_word);
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
    hwy::Prefetch(boxes + ahead_bytes);
    const auto tl = hn::Mul(hn::Sub(lower, origin), scale);
    const auto tu = hn::Mul(hn::Sub(upper, origin), scale);
    const auto ql = to_index(di, hn::Min(hn::Max(tl, hn::Zero(df)), most));
    const auto qu = to_index(di, hn::Min(hn::Max(tu, hn::Zero(df)), most));
    const auto cl = hn::ShiftRight<core::word_bits>(ql);
    const auto span = hn::Sub(hn::ShiftRight<core::word_bits>(qu), cl);
    const auto next = hn::RebindMask(du, hn::Eq(span, one));
    const auto further = hn::RebindMask(du, hn::Gt(span, one));
    const auto valid = hn::RebindMask(du, hn::Le(lower, upper));
    auto number = hn::Mul(hn::BitCast(du, cl), stride_of);
    number = hn::Add(number, hn::IfThenElseZero(next, next_unit));
    number = hn::Add(number, hn::IfThenElseZero(further, further_unit));
    number = hn::Add(number, hn::IfThenZeroElse(valid, invalid_unit));
    number = hn::Add(number, hn::Shuffle1032(number));
    number = hn::Add(number, hn::Shuffle2301(number));
    hn::StoreU(number, du, out.number[i]);
    const auto words = hn::Or(hn::TableLookupBytesOr0(hn::BitCast(db, ql), take_lower),
                              hn::TableLookupBytesOr0(hn::BitCast(db, qu), take_upper));
    const auto whole =
        hn::Or(hn::Max(hn::And(hn::BitCast(dw, words), low_part), least), hn::BitCast(dw, id));
    hn::StoreU(whole, dw, reinterpret_cast<std::uint16_t*>(out.whole + i));
    const auto raised = hn::IfThenElseZero(hn::Gt(span, hn::Zero(di)), top);
    const auto record = hn::Or(
        whole, hn::BitCast(dw, hn::TableLookupBytesOr0(hn::BitCast(db, raised), take_upper)));
    hn::StoreU(record, dw, reinterpret_cast<std::uint16_t*>(out.record + i));
    id = hn::Add(id, id_step);
  }
  if (ids) {
    for (std::uint32_t i = 0; i < count; ++i) out.record[i].id = out.whole[i].id = ids[i];
  }

  // Every box is copied to where its first column's next record goes; one that is left to the
  // caller stays invisible there.
  std::uintptr_t* const tails = out.tail;
  std::uint32_t several_count = 0;
  std::uint8_t several[bin_tile];
  static_assert(bin_tile <= 256);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t number = out.number[i][0];
    // Of any box the low bits are a column of the grid: no branch to guess wrong.
    const std::uint32_t column = number & (most_columns - 1);
    const std::uintptr_t tail = out.room(column);
    store_record(tail, load_record(out.record + i));
    several[several_count] = static_cast<std::uint8_t>(i);
    several_count += number >= most_columns;
    tails[column] = tail + sizeof(Record) * (number < further_number);
  }
  copy_on(map, several, several_count, out);
}

}  // namespace throng::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
