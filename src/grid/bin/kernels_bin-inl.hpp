// Binning over vectors. Included once per instruction set.
#if defined(THRONG_KERNELS_BIN_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_BIN_INL
#undef THRONG_KERNELS_BIN_INL
#else
#define THRONG_KERNELS_BIN_INL
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "base/prefetch.hpp"
#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// One corner of each box, one box per 128-bit block. The fourth lane holds whatever follows in
// memory.
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

// The lower and upper corners of one vector of boxes.
template <class D>
HWY_INLINE void load_boxes(D d, const char* boxes, std::size_t stride, hn::Vec<D>& lower,
                           hn::Vec<D>& upper) {
#if HWY_TARGET == HWY_AVX3_DL
  if (stride == 24) {
    // Four boxes are 24 floats: two loads and two permutes.
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

// Truncates. The input is within 0 .. 2^27, so no out-of-range handling is needed.
template <class D>
HWY_INLINE hn::Vec<D> to_index(D d, hn::VFromD<hn::RebindToFloat<D>> x) {
#if HWY_TARGET == HWY_AVX3_DL
  (void)d;
  return hn::Vec<D>{_mm512_cvttps_epi32(x.raw)};
#elif HWY_TARGET == HWY_AVX2
  (void)d;
  return hn::Vec<D>{_mm256_cvttps_epi32(x.raw)};
#else
  return hn::ConvertTo(d, x);
#endif
}

// Repeats `four` in each block.
template <class D, class T>
HWY_INLINE hn::Vec<D> repeat_per_block(D d, const T* four) {
  return hn::LoadDup128(d, four);
}

using RecordVector = hn::Vec<hn::FixedTag<std::uint16_t, 8>>;
HWY_INLINE RecordVector load_record(const Record* r) {
  return hn::Load(hn::FixedTag<std::uint16_t, 8>(), reinterpret_cast<const std::uint16_t*>(r));
}
HWY_INLINE void store_record(std::uintptr_t to, RecordVector record) {
  hn::StoreU(record, hn::FixedTag<std::uint16_t, 8>(), reinterpret_cast<std::uint16_t*>(to));
}

// Masks that turn a box's record into that of one of its columns, indexed by axes (a bit each):
// where it starts in an earlier column the lower coordinate is 0, where it ends in a later one the
// upper is the maximum.
struct RecordMasks {
  alignas(16) std::uint16_t lower[8][8] = {};
  alignas(16) std::uint16_t upper[8][8] = {};
  constexpr RecordMasks() {
    for (int axes = 0; axes < 8; ++axes) {
      for (int k = 0; k < 3; ++k) {
        lower[axes][k] = (axes >> k & 1) ? 0xffff : 0;
        upper[axes][3 + k] = (axes >> k & 1) ? base::max_quantized : 0;
      }
    }
  }
};
inline constexpr RecordMasks record_masks;

HWY_INLINE RecordVector load_mask(const std::uint16_t (&mask)[8]) {
  return hn::Load(hn::FixedTag<std::uint16_t, 8>(), mask);
}

// From a number's span bits: the axes on which the box touches a second column, a bit each; 0 if it
// goes beyond that on any axis.
struct SecondColumns {
  std::uint8_t axes[64] = {};
  constexpr SecondColumns() {
    for (unsigned bits = 0; bits < 64; ++bits) {
      const bool beyond = (bits << column_bits & needs_slow_path) != 0;
      const unsigned of = (bits & 1) | (bits >> 1 & 2) | (bits >> 2 & 4);
      axes[bits] = static_cast<std::uint8_t>(beyond ? 0 : of);
    }
  }
};
inline constexpr SecondColumns second_columns;

// For a box that touches a second column on some axes: the 1, 3 or 7 further columns. Low bits: the
// axes on which the copy is in the second column; above, the remaining ones of these axes.
struct Copies {
  alignas(16) std::uint16_t of[8][8] = {};
  std::uint8_t count[8] = {};
  constexpr Copies() {
    for (unsigned axes = 0; axes < 8; ++axes) {
      for (unsigned part = axes; part != 0; part = (part - 1) & axes)
        of[axes][count[axes]++] = static_cast<std::uint16_t>(part | (axes & ~part) << 3);
    }
  }
};
inline constexpr Copies copies;

// Streams the column's full buffer, if any, to its block. Returns the address of the next record.
HWY_NOINLINE std::uintptr_t flush_buffer(RecordOutput& out, std::uint32_t column) {
  const hn::ScalableTag<std::uint8_t> d;
  if (const std::uintptr_t end = out.tail[column]) {
    const std::size_t bytes = out.buffer_mask() + 1;
    const auto* const from = reinterpret_cast<const std::uint8_t*>(out.buffer(column));
    auto* const to = reinterpret_cast<std::uint8_t*>(end - bytes);
    for (std::size_t k = 0; k < bytes; k += hn::MaxLanes(d))
      hn::Stream(hn::Load(d, from + k), d, to + k);
  }
  return out.next_slot(column);
}

// Writes the column's next record and returns its address. The caller updates the tail.
template <bool buffered>
HWY_INLINE std::uintptr_t put(RecordOutput& out, std::uint32_t column, RecordVector record) {
  if constexpr (!buffered) {
    const std::uintptr_t at = out.next_slot(column);
    store_record(at, record);
    return at;
  } else {
    std::uintptr_t at = out.tail[column];
    if (HWY_UNLIKELY((at & out.buffer_mask()) == 0)) at = flush_buffer(out, column);
    store_record(reinterpret_cast<std::uintptr_t>(out.buffer(column)) + (at & out.buffer_mask()),
                 record);
    return at;
  }
}

// Copies the boxes that touch a second column on some axes into their other columns. All copies are
// listed first, which avoids one mispredicted branch per box.
template <bool buffered>
HWY_NOINLINE void write_copies(const base::Quantizer& map, const std::uint32_t* multi_column,
                               std::uint32_t count, RecordOutput& out) {
  const hn::FixedTag<std::uint16_t, 8> d;
  std::uint16_t list[bin_tile * 7 + 1];
  static_assert(bin_tile <= 1024);  // 10 bits for the box, 6 for the copy
  std::uint32_t listed = 0, deferred = 0;
  for (std::uint32_t s = 0; s < count; ++s) {
    const std::uint32_t i = multi_column[s];
    const std::uint32_t axes = second_columns.axes[out.number[i] >> column_bits];
    const auto box = hn::Set(d, static_cast<std::uint16_t>(i << 6));
    hn::StoreU(hn::Or(hn::Load(d, copies.of[axes]), box), d, list + listed);
    listed += copies.count[axes];
    out.deferred[deferred] = i;
    deferred += axes == 0;
  }
  out.deferred_count = deferred;
  std::uint32_t ahead[8] = {};
  for (std::uint32_t part = 1; part < 8; ++part) {
    for (int k = 0; k < 3; ++k) ahead[part] += (part >> k & 1) ? map.stride[k] : 0;
  }
  for (std::uint32_t c = 0; c < listed; ++c) {
    const std::uint32_t i = list[c] >> 6, part = list[c] & 7, others = list[c] >> 3 & 7;
    const std::uint32_t column = (out.number[i] & (max_columns - 1)) + ahead[part];
    const RecordVector record = hn::Or(
        hn::AndNot(load_mask(record_masks.lower[part]), load_record(out.first_column_record + i)),
        load_mask(record_masks.upper[others]));
    out.tail[column] = put<buffered>(out, column, record) + sizeof(Record);
  }
}

template <std::uint32_t bits>
using Bits = std::integral_constant<int, static_cast<int>(bits)>;

// Boxes are prefetched this far ahead; a column's next line once the first of its four records is
// written, as an earlier prefetch may be evicted again. Gains: docs/explanation/what-was-tried.md.
constexpr std::size_t prefetch_bytes = 3072;
constexpr std::size_t records_ahead = 3;

// Copies every box to its first column's next record. For a box that is left to the caller the tail
// does not move, so the copy is overwritten.
template <bool buffered>
HWY_INLINE void write_records(const base::Quantizer& map, const std::uint32_t* multi_column,
                              std::uint32_t multi_column_count, std::uint32_t count,
                              RecordOutput& out) {
  std::uintptr_t* const tails = out.tail;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t number = out.number[i];
    // A buffer cannot hold such a copy: it may be the first after a flush.
    if (buffered && (number & needs_slow_path) != 0) continue;
    // The low bits are a valid column for any box, so no branch is needed.
    const std::uint32_t column = number & (max_columns - 1);
    const auto& mask = record_masks.upper[second_columns.axes[number >> column_bits]];
    const std::uintptr_t tail = put<buffered>(
        out, column, hn::Or(load_record(out.first_column_record + i), load_mask(mask)));
    if constexpr (!buffered)
      base::prefetch_exclusive(reinterpret_cast<const Record*>(tail) + records_ahead);
    tails[column] = tail + sizeof(Record) * ((number & needs_slow_path) == 0);
  }
  write_copies<buffered>(map, multi_column, multi_column_count, out);
}

// The positions of base::quantize; `by_bits` selects the lanes whose position is their bits.
// Denormals are not multiplied (up to 150 cycles each), so by_bits includes the unused fourth lane.
template <class V, class M>
HWY_INLINE V positions(V x, M by_bits, V centre, V factor) {
  const hn::DFromV<V> df;
  const hn::RebindToSigned<decltype(df)> di;
  const auto bits = hn::BitCast(di, hn::Add(hn::Sub(x, centre), hn::Zero(df)));
  const auto ordered = hn::Xor(bits, hn::And(hn::BroadcastSignBit(bits), hn::Set(di, 0x7fffffff)));
  return hn::IfThenElse(by_bits, hn::ConvertTo(df, ordered),
                        hn::Mul(hn::IfThenZeroElse(by_bits, x), factor));
}

// `plain`: Quantizer::plain.
template <bool plain>
HWY_NOINLINE void bin_impl(const base::Quantizer& map, const BinInput& in, RecordOutput& out) {
  const char* boxes = in.boxes;
  const std::size_t stride = in.stride;
  const std::uint32_t count = in.count;
  const hn::ScalableTag<float> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::RebindToUnsigned<decltype(df)> du;
  const hn::Repartition<std::uint8_t, decltype(df)> db;
  const hn::Repartition<std::uint16_t, decltype(df)> dw;
  const hn::Repartition<std::uint64_t, decltype(df)> d64;
  // Boxes per vector of corners; and boxes per step, one per 32-bit lane.
  constexpr std::uint32_t group = static_cast<std::uint32_t>(hn::MaxLanes(df)) / 4;
  constexpr std::uint32_t boxes_per_step = 4 * group;
  static_assert(bin_group % group == 0 && bin_tile % boxes_per_step == 0);
  constexpr std::uint32_t chunk = 64;
  const std::size_t step = std::max<std::size_t>(stride, 64);  // one per line, or per box

  const auto origin = repeat_per_block(df, map.origin);
  const auto scale = repeat_per_block(df, map.scale);
  const auto max_index = repeat_per_block(df, map.max);
  const auto centre = repeat_per_block(df, map.centre), factor = repeat_per_block(df, map.factor);
  const auto stride_x = hn::Set(du, map.stride[0]), stride_y = hn::Set(du, map.stride[1]),
             stride_z = hn::Set(du, map.stride[2]);
  alignas(16) static constexpr std::uint8_t lower_bytes[16] = {
      0, 1, 4, 5, 8, 9, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128};
  alignas(16) static constexpr std::uint8_t upper_bytes[16] = {
      128, 128, 128, 128, 128, 128, 0, 1, 4, 5, 8, 9, 128, 128, 128, 128};
  alignas(16) static constexpr std::uint16_t least_words[8] = {1, 1, 1, 1, 1, 1, 0, 0};
  const auto take_lower = repeat_per_block(db, lower_bytes);
  const auto take_upper = repeat_per_block(db, upper_bytes);
  const auto least = repeat_per_block(dw, least_words);
  const auto column_part = hn::Set(du, 0xffffu), two = hn::Set(du, 2), three = hn::Set(du, 3);
  const auto no_box = hn::Set(du, 0x80000000u);
  const auto low_part = hn::Set(dw, base::max_quantized);
  // Ids go in the fourth lane of each block.
  const auto position = hn::Iota(du, 0);
  // Interleaving keeps the boxes of each block adjacent; this permutation restores their order.
  alignas(64) std::uint32_t lanes[boxes_per_step];
  for (std::uint32_t k = 0; k < boxes_per_step; ++k) lanes[k] = k % group * 4 + k / group;
  const auto in_order = hn::SetTableIndices(du, lanes);
  const auto is_fourth = hn::Eq(hn::And(position, three), three);
  const auto by_bits = hn::RebindMask(
      df, hn::Or(hn::Ne(repeat_per_block(du, map.by_bits), hn::Zero(du)), is_fourth));
  auto id =
      hn::IfThenElseZero(is_fourth, hn::Add(hn::Set(du, in.first_id), hn::ShiftRight<2>(position)));
  const auto id_step = hn::IfThenElseZero(is_fourth, hn::Set(du, group));

  // On one axis: column of the lower end (low bits) and distance of the upper end's column (above).
  const auto column_and_span = [&](auto both, auto stride_of, auto shift) HWY_ATTR {
    const auto first = hn::And(both, column_part);
    const auto span = hn::Sub(hn::ShiftRight<16>(both), first);
    return hn::Add(hn::Mul(first, stride_of),
                   hn::ShiftLeft<decltype(shift)::value>(hn::Min(span, two)));
  };

  // Two short loops keep more instructions in flight than one long loop. First: records, and the
  // columns of both ends on each axis, 16 bits each. Second: the packed numbers.
  alignas(64) std::uint32_t ends[chunk][4];
  std::uint32_t multi_column[bin_tile + boxes_per_step], multi_column_count = 0;
  auto place = position;
  for (std::uint32_t begin = 0; begin < count; begin += chunk) {
    const std::uint32_t end = std::min(begin + chunk, count);
    for (std::uint32_t i = begin; i < end; i += group) {
      hn::Vec<decltype(df)> lower, upper;
      load_boxes(df, boxes, stride, lower, upper);
      boxes += group * stride;
      for (std::size_t at = 0; at < group * stride; at += step)
        base::prefetch_l1(boxes + prefetch_bytes + at);
      const auto pl = plain ? lower : positions(lower, by_bits, centre, factor);
      const auto pu = plain ? upper : positions(upper, by_bits, centre, factor);
      const auto tl = hn::Mul(hn::Sub(pl, origin), scale);
      const auto tu = hn::Mul(hn::Sub(pu, origin), scale);
      const auto ql = to_index(di, hn::Min(hn::Max(tl, hn::Zero(df)), max_index));
      const auto qu = to_index(di, hn::Min(hn::Max(tu, hn::Zero(df)), max_index));
      const auto words = hn::Or(look_up_bytes(hn::BitCast(db, ql), take_lower),
                                look_up_bytes(hn::BitCast(db, qu), take_upper));
      const auto first_column_record =
          hn::Or(hn::Max(hn::And(hn::BitCast(dw, words), low_part), least), hn::BitCast(dw, id));
      hn::StoreU(first_column_record, dw,
                 reinterpret_cast<std::uint16_t*>(out.first_column_record + i));
      id = hn::Add(id, id_step);
      const auto valid = hn::RebindMask(du, hn::Le(lower, upper));
      const auto first = hn::ShiftRight<base::quantized_bits>(hn::BitCast(du, ql));
      const auto last =
          hn::AndNot(column_part, hn::ShiftLeft<16 - base::quantized_bits>(hn::BitCast(du, qu)));
      hn::StoreU(hn::Or(hn::Or(first, last), hn::IfThenZeroElse(valid, no_box)), du,
                 ends[i - begin]);
    }
    for (std::uint32_t i = begin; i < end; i += boxes_per_step) {
      const auto from = ends + (i - begin);
      const auto p0 = hn::Load(du, from[0]), p1 = hn::Load(du, from[group]),
                 p2 = hn::Load(du, from[2 * group]), p3 = hn::Load(du, from[3 * group]);
      const auto xy01 = hn::BitCast(d64, hn::InterleaveLower(du, p0, p1));
      const auto xy23 = hn::BitCast(d64, hn::InterleaveLower(du, p2, p3));
      const auto z01 = hn::BitCast(d64, hn::InterleaveUpper(du, p0, p1));
      const auto z23 = hn::BitCast(d64, hn::InterleaveUpper(du, p2, p3));
      const auto x = hn::BitCast(du, hn::InterleaveLower(d64, xy01, xy23));
      const auto y = hn::BitCast(du, hn::InterleaveUpper(d64, xy01, xy23));
      const auto z = hn::BitCast(du, hn::InterleaveLower(d64, z01, z23));
      const auto mixed = hn::Add(hn::Add(column_and_span(x, stride_x, Bits<column_bits>()),
                                         column_and_span(y, stride_y, Bits<column_bits + 2>())),
                                 column_and_span(z, stride_z, Bits<column_bits + 4>()));
      auto number = mixed;
      if constexpr (group > 1) number = hn::TableLookupLanes(mixed, in_order);
      if (out.column_offset) {
        const auto world = hn::LoadU(du, out.column_offset.data() + i),
                   low = hn::Set(du, max_columns - 1);
        number = hn::Or(hn::Add(number, hn::And(world, low)), hn::AndNot(low, world));
      }
      hn::StoreU(number, du, out.number + i);
      // Branch-free list; the last vector may extend past `count`.
      std::uint32_t bits = bits_of(du, hn::Gt(number, hn::Set(du, max_columns - 1)));
      if (count - i < boxes_per_step) bits &= (1u << (count - i)) - 1;
      hn::StoreU(compress(place, bits), du, multi_column + multi_column_count);
      multi_column_count += static_cast<std::uint32_t>(std::popcount(bits));
      place = hn::Add(place, hn::Set(du, boxes_per_step));
    }
  }
  if (in.ids) {
    for (std::uint32_t i = 0; i < count; ++i) out.first_column_record[i].id = in.ids[i];
  }

  if (out.buffers)
    write_records<true>(map, multi_column, multi_column_count, count, out);
  else
    write_records<false>(map, multi_column, multi_column_count, count, out);
}

inline void bin(const base::Quantizer& map, const BinInput& in, RecordOutput& out) {
  if (map.is_identity)
    bin_impl<true>(map, in, out);
  else
    bin_impl<false>(map, in, out);
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
