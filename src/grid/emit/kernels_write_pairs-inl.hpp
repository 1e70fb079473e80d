// Masks, compaction and pair output over vectors. Included once per instruction set.
#if defined(THRONG_KERNELS_WRITE_PAIRS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_WRITE_PAIRS_INL
#undef THRONG_KERNELS_WRITE_PAIRS_INL
#else
#define THRONG_KERNELS_WRITE_PAIRS_INL
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "base/compress_table.hpp"
#include "base/prefetch.hpp"
#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D16 = hn::ScalableTag<std::int16_t>;
using D32 = hn::ScalableTag<std::uint32_t>;
using V16 = hn::Vec<D16>;
using V32 = hn::Vec<D32>;

template <class D>
HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
#if HWY_TARGET == HWY_AVX3_DL
  (void)d;
  return static_cast<std::uint32_t>(mask.raw);
#elif HWY_TARGET == HWY_WASM
  // Highway 1.0 gathers the bits in memory.
  (void)d;
  constexpr std::size_t lane_bytes = sizeof(hn::TFromD<D>);
  static_assert(lane_bytes == 1 || lane_bytes == 2 || lane_bytes == 4);
  if constexpr (lane_bytes == 1) return wasm_i8x16_bitmask(mask.raw);
  if constexpr (lane_bytes == 2) return wasm_i16x8_bitmask(mask.raw);
  return wasm_i32x4_bitmask(mask.raw);
#else
  // Reads the same width that was written: a wider load would miss store forwarding.
  constexpr std::size_t lanes = hn::MaxLanes(D());
  using Bits = std::conditional_t<lanes <= 8, std::uint8_t,
                                  std::conditional_t<lanes <= 16, std::uint16_t, std::uint32_t> >;
  Bits bits;
  hn::StoreMaskBits(d, mask, reinterpret_cast<std::uint8_t*>(&bits));
  return bits;
#endif
}

// The bytes of `from` at `indices`, in each block; 0 for an index above 127.
template <class V>
HWY_INLINE V look_up_bytes(V from, V indices) {
#if HWY_TARGET == HWY_WASM
  // Highway 1.0 reads one byte after the other.
  return V{wasm_i8x16_swizzle(from.raw, indices.raw)};
#else
  return hn::TableLookupBytesOr0(from, indices);
#endif
}

#if HWY_TARGET == HWY_WASM
// The indices of bytes that move the lanes of a mask of four to the front.
struct FrontBytes {
  alignas(16) std::uint8_t of[16][16] = {};
  constexpr FrontBytes() {
    for (unsigned bits = 0; bits < 16; ++bits) {
      for (unsigned k = 0; k < 16; ++k)
        of[bits][k] =
            static_cast<std::uint8_t>(4 * base::compress_table.lanes[bits][k / 4] + k % 4);
    }
  }
};
inline constexpr FrontBytes front_bytes;
#endif

// Moves the lanes of `bits` to the front, in order; the rest is unspecified.
HWY_INLINE V32 compress(V32 v, std::uint32_t bits) {
#if HWY_TARGET == HWY_AVX3_DL
  return hn::Compress(v, hn::Mask<D32>{static_cast<__mmask16>(bits)});
#elif HWY_TARGET == HWY_WASM
  return V32{wasm_i8x16_swizzle(v.raw, wasm_v128_load(front_bytes.of[bits & 15]))};
#else
  static_assert(hn::MaxLanes(D32()) <= 8, "wider vectors need a form of their own");
  // Highway's version keeps its table in the function, and GCC copies that to the stack per call.
  const D32 d;
  const hn::Rebind<std::uint8_t, D32> bytes;
  const auto index = hn::PromoteTo(d, hn::LoadU(bytes, base::compress_table.lanes[bits & 0xff]));
  return hn::TableLookupLanes(v, hn::IndicesFromVec(d, index));
#endif
}

// Stores first 0, second 0, first 1, second 1, ... of at least `count` lanes.
HWY_INLINE void store_interleaved(V32 first, V32 second, int count, std::uint32_t* to) {
  const D32 d;
#if HWY_TARGET == HWY_AVX3_DL
  // One shuffle per store; 128-bit interleaving takes three, and the shuffle port is the
  // bottleneck.
  const __m512i low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  const __m512i high =
      _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
  hn::StoreU(V32{_mm512_permutex2var_epi32(first.raw, low, second.raw)}, d, to);
  if (HWY_UNLIKELY(count > 8)) {
    hn::StoreU(V32{_mm512_permutex2var_epi32(first.raw, high, second.raw)}, d, to + 16);
  }
#else
  (void)count;
  hn::StoreInterleaved2(first, second, d, to);
#endif
}

// Stores at least `count` pairs, lane by lane.
template <Orientation orientation>
HWY_INLINE void store_pairs(V32 query, V32 target, V32 target_id_offset, int count, Pair* out) {
  std::uint32_t* to = reinterpret_cast<std::uint32_t*>(out);
  if constexpr (orientation == Orientation::unordered) {
    const V32 second = hn::Sub(hn::Max(query, target), target_id_offset);
    store_interleaved(hn::Min(query, target), second, count, to);
  } else if constexpr (orientation == Orientation::query_first) {
    store_interleaved(query, target, count, to);
  } else {
    store_interleaved(target, query, count, to);
  }
}

// Confirmed pairs, or quantization ties that the floats decide.
enum class PairState : bool { tie, confirmed };

// Writes pairs at the output cursor and flushes at the limit. It must be the only writer of that
// cursor while it exists.
template <Orientation orientation, PairState state = PairState::confirmed>
class PairWriter {
 public:
  explicit PairWriter(PairOutput& out)
      : out_(out), cursor_(end()), limit_(limit()), offset_(hn::Set(D32(), out.target_id_offset)) {}
  ~PairWriter() { end() = cursor_; }
  PairWriter(const PairWriter&) = delete;
  PairWriter& operator=(const PairWriter&) = delete;

  HWY_INLINE void put(V32 query, V32 target, int count) {
    store_pairs<orientation>(query, target, offset_, count, cursor_);
    cursor_ += count;
    if constexpr (state == PairState::confirmed) {
      const char* const later = reinterpret_cast<const char*>(cursor_) + prefetch_bytes;
      base::prefetch_exclusive(later);
      if (HWY_UNLIKELY(count > 8)) base::prefetch_exclusive(later + 64);
    }
    if (HWY_LIKELY(cursor_ <= limit_)) return;
    end() = cursor_;
    state == PairState::confirmed ? out_.flush() : out_.flush_ties();
    cursor_ = end();
    limit_ = limit();
  }

 private:
  // Output lines are prefetched this far ahead: see docs/explanation/what-was-tried.md.
  static constexpr std::size_t prefetch_bytes = 4096;

  Pair*& end() const { return state == PairState::confirmed ? out_.cursor : out_.tie_cursor; }
  Pair* limit() const { return state == PairState::confirmed ? out_.limit : out_.tie_limit; }

  PairOutput& out_;
  Pair* cursor_;
  Pair* limit_;
  V32 offset_;
};

#if HWY_TARGET == HWY_AVX3_DL
// Calls take(positions, count) for the set bits in order, up to sixteen at a time.
template <class Take>
HWY_INLINE void for_each_set_bit(std::uint64_t bits, Take&& take) {
  const hn::Repartition<std::uint8_t, D32> d8;
  const auto places = _mm512_maskz_compress_epi8(bits, hn::Iota(d8, 0).raw);
  const int count = std::popcount(bits);
  take(V32{_mm512_cvtepu8_epi32(_mm512_castsi512_si128(places))}, std::min(count, 16));
  if (HWY_LIKELY(count <= 16)) return;
  alignas(64) std::uint8_t more[64];
  _mm512_store_si512(more, places);
  for (int k = 16; k < count; k += 16) {
    const __m128i next = _mm_load_si128(reinterpret_cast<const __m128i*>(more + k));
    take(V32{_mm512_cvtepu8_epi32(next)}, std::min(count - k, 16));
  }
}
#endif

// Matches: the first query index (low half) and first target index (high half), and a bit per
// tested pair.
struct Hits {
  static constexpr std::size_t capacity = 256;
  std::uint64_t place[capacity + 1], overlaps[capacity + 1];
  std::size_t count = 0;

  // Branch-free: an empty entry is overwritten. Loops keep the count in a local `end`, because the
  // compiler must assume that these stores may change the member.
  HWY_INLINE void add(std::size_t query, std::size_t target, std::uint64_t bits, std::size_t& end) {
    place[end] = query | std::uint64_t{target} << 32;
    overlaps[end] = bits;
    end += bits != 0;
  }
  HWY_INLINE void add(std::size_t query, std::size_t target, std::uint64_t bits) {
    add(query, target, bits, count);
  }
  std::size_t query(std::size_t h) const { return static_cast<std::uint32_t>(place[h]); }
  std::size_t target(std::size_t h) const { return static_cast<std::uint32_t>(place[h] >> 32); }
};

// Writes the pairs of all hits. With AVX-512, ids_at(query, target) loads the ids of the tested
// boxes into registers and returns a function that picks from them by (positions, queries,
// targets); elsewhere ids_at(query, target, first bit, bits, queries, targets) compresses them.
template <Orientation orientation, PairState state, class IdsAt>
HWY_INLINE void write_pairs(Hits& hits, PairOutput& out, IdsAt&& ids_at) {
  PairWriter<orientation, state> pairs(out);
#if HWY_TARGET == HWY_AVX3_DL
  for (std::size_t h = 0; h < hits.count; ++h) {
    const auto pick = ids_at(hits.query(h), hits.target(h));
    for_each_set_bit(hits.overlaps[h], [&](V32 place, int count) HWY_ATTR {
      V32 query, target;
      pick(place, query, target);
      pairs.put(query, target, count);
    });
  }
#else
  // One vector of ids per hit and round; the remaining bits go to the next round.
  constexpr unsigned id_lanes = hn::MaxLanes(D32());
  constexpr std::uint64_t group = (std::uint64_t{1} << id_lanes) - 1;
  for (std::size_t count = hits.count, rest = 0; count != 0; count = rest) {
    rest = 0;
    for (std::size_t h = 0; h < count; ++h) {
      const std::size_t first_query = hits.query(h), first_target = hits.target(h);
      const std::uint64_t overlaps = hits.overlaps[h];
      const unsigned from = static_cast<unsigned>(std::countr_zero(overlaps)) & ~(id_lanes - 1);
      const auto bits = static_cast<std::uint32_t>(overlaps >> from & group);
      hits.place[rest] = hits.place[h];
      hits.overlaps[rest] = overlaps & ~(group << from);
      rest += hits.overlaps[rest] != 0;
      V32 query, target;
      ids_at(first_query, first_target, from, bits, query, target);
      pairs.put(query, target, std::popcount(bits));
    }
  }
#endif
  hits.count = 0;
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
