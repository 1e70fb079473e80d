// Sweeping and brute force over vectors. Included once an instruction set.
#if defined(THRONG_KERNELS_SWEEP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_SWEEP_INL
#undef THRONG_KERNELS_SWEEP_INL
#else
#define THRONG_KERNELS_SWEEP_INL
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "cpu/compress_table.hpp"
#include "cpu/kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Queries are taken in blocks, so that the lists of a block stay in the first level of cache.
constexpr std::uint32_t query_block = 256;

using D16 = hn::ScalableTag<std::uint16_t>;
using D32 = hn::ScalableTag<std::uint32_t>;
using V16 = hn::Vec<D16>;
using V16h = hn::Vec<hn::Half<D16>>;

template <class D>
HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
#if HWY_TARGET == HWY_AVX3
  (void)d;
  return static_cast<std::uint32_t>(mask.raw);
#else
  // Read back as wide as it was written: a wider load would wait for the store to leave the core.
  if constexpr (hn::MaxLanes(D()) <= 8) {
    std::uint8_t bits;
    hn::StoreMaskBits(d, mask, &bits);
    return bits;
  } else {
    std::uint16_t bits;
    hn::StoreMaskBits(d, mask, reinterpret_cast<std::uint8_t*>(&bits));
    return bits;
  }
#endif
}

// The mask of the lowest bits.
HWY_INLINE hn::Mask<D32> mask_of(std::uint32_t bits) {
#if HWY_TARGET == HWY_AVX3
  return hn::Mask<D32>{static_cast<__mmask16>(bits)};
#else
  std::uint8_t bytes[8];
  std::memcpy(bytes, &bits, sizeof bits);
  return hn::LoadMaskBits(D32(), bytes);
#endif
}

// The lanes that `bits` names, in order, then others.
HWY_INLINE hn::Vec<D32> compress(hn::Vec<D32> v, std::uint32_t bits) {
#if HWY_TARGET == HWY_AVX3
  return hn::Compress(v, mask_of(bits));
#else
  // Highway's own keeps its table in the function, which GCC copies to the stack at each call.
  const D32 d;
  const hn::Rebind<std::uint8_t, D32> bytes;
  const auto index = hn::PromoteTo(d, hn::LoadU(bytes, compress_table.lanes[bits & 0xff]));
  return hn::TableLookupLanes(v, hn::IndicesFromVec(d, index));
#endif
}

// first 0, second 0, first 1, second 1, ...
HWY_INLINE void store_interleaved(hn::Vec<D32> first, hn::Vec<D32> second, std::uint32_t* to) {
#if HWY_TARGET == HWY_AVX3
  // One shuffle a store; by 128-bit blocks it takes three, and shuffles are what is short here.
  const __m512i low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  const __m512i high =
      _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
  _mm512_storeu_si512(to, _mm512_permutex2var_epi32(first.raw, low, second.raw));
  _mm512_storeu_si512(to + 16, _mm512_permutex2var_epi32(first.raw, high, second.raw));
#else
  hn::StoreInterleaved2(first, second, D32(), to);
#endif
}

// The pairs of one query with those of a vector's worth of ids that `bits` names.
template <Orientation orientation>
HWY_INLINE Pair* append(Pair* out, std::uint32_t query_id, const std::uint32_t* ids,
                        std::uint32_t bits) {
  const D32 d;
  const auto target = compress(hn::LoadU(d, ids), bits);
  const auto query = hn::Set(d, query_id);
  std::uint32_t* to = reinterpret_cast<std::uint32_t*>(out);
  if constexpr (orientation == Orientation::unordered) {
    store_interleaved(hn::Min(query, target), hn::Max(query, target), to);
  } else if constexpr (orientation == Orientation::query_first) {
    store_interleaved(query, target, to);
  } else {
    store_interleaved(target, query, to);
  }
  return out + std::popcount(bits);
}

// A box as a query: each word twice, so that one 32-bit load spreads it over a vector. Axis 0 here
// is the sweep axis.
struct Query {
  std::uint32_t upper0, lower1, upper1, lower2;
  std::uint32_t upper2, lower0, id, unused;
};
static_assert(sizeof(Query) == 32);

// The queries of one block, made of its records by a shuffle of bytes for each half.
struct Queries {
  static constexpr std::uint32_t padding = 8;  // read beyond the end, not used
  Query query[query_block + padding];
  std::uint32_t begin = 0, end = 0;
  std::uint8_t bytes[32];

  // The queries are filled by take().
  // cppcheck-suppress uninitMemberVar
  explicit Queries(std::uint32_t axis) {
    const auto lower = [&](std::uint32_t k) { return 2 * ((axis + k) % 3); };
    const auto upper = [&](std::uint32_t k) { return 6 + 2 * ((axis + k) % 3); };
    const std::uint32_t words[6] = {upper(0), lower(1), upper(1), lower(2), upper(2), lower(0)};
    for (std::uint32_t b = 0; b < 24; ++b)
      bytes[b] = static_cast<std::uint8_t>(words[b / 4] + b % 2);
    for (std::uint32_t b = 24; b < 32; ++b) bytes[b] = static_cast<std::uint8_t>(12 + b % 4);
  }
  HWY_NOINLINE void take(const Strip& strip, std::uint32_t from) {
    const hn::FixedTag<std::uint8_t, 16> d;
    begin = from;
    end = from + query_block < strip.count ? from + query_block : strip.count;
    const auto first = hn::LoadU(d, bytes), second = hn::LoadU(d, bytes + 16);
    std::uint8_t* to = reinterpret_cast<std::uint8_t*>(query);
    for (std::uint32_t i = begin; i < end; ++i, to += sizeof(Query)) {
      const auto record = hn::LoadU(d, reinterpret_cast<const std::uint8_t*>(strip.record + i));
      hn::StoreU(hn::TableLookupBytes(record, first), d, to);
      hn::StoreU(hn::TableLookupBytes(record, second), d, to + 16);
    }
    std::memset(to, 0, padding * sizeof(Query));
  }
};

// Queries that may meet some of the vector of targets at `at`.
struct Hits {
  struct Place {
    std::uint32_t query, at;
  };
  Place place[query_block + 8];
  std::uint32_t mask[query_block + 8];
  std::size_t count = 0;

  // Without a branch: what was not hit is overwritten.
  HWY_INLINE void add(std::uint32_t query, std::uint32_t at, std::uint32_t bits) {
    place[count] = {query, at};
    mask[count] = bits;
    count += bits != 0;
  }
};

// The same by half vectors: most hits lie in one half, and half a vector seldom crosses cache
// lines.
struct HalfHits {
  Hits::Place place[2 * query_block + 16];
  std::uint32_t mask[2 * query_block + 16];
  std::size_t count = 0;

  HWY_INLINE void take(const Hits& hits) {
    constexpr std::uint32_t half = static_cast<std::uint32_t>(hn::MaxLanes(D32()));
    std::size_t to = 0;
    for (std::size_t h = 0; h < hits.count; ++h) {
      const Hits::Place p = hits.place[h];
      const std::uint32_t low = hits.mask[h] & ((1u << half) - 1), high = hits.mask[h] >> half;
      place[to] = p;
      mask[to] = low;
      to += low != 0;
      place[to] = {p.query, p.at + half};
      mask[to] = high;
      to += high != 0;
    }
    count = to;
  }
};

// Queries whose window goes on at `at`.
struct Open {
  Hits::Place place[query_block + 64];
  std::uint32_t count = 0;
};

// The arrays of a strip as targets, in registers.
struct Targets {
  const std::uint16_t* HWY_RESTRICT lower0;
  const std::uint16_t* HWY_RESTRICT lower1;
  const std::uint16_t* HWY_RESTRICT upper1;
  const std::uint16_t* HWY_RESTRICT lower2;
  const std::uint16_t* HWY_RESTRICT upper2;
  explicit Targets(const Strip& t)
      : lower0(t.lower[0]),
        lower1(t.lower[1]),
        upper1(t.upper[1]),
        lower2(t.lower[2]),
        upper2(t.upper[2]) {}
};

HWY_INLINE V16 spread(const std::uint32_t& doubled) {
  return hn::BitCast(D16(), hn::Set(D32(), doubled));
}
HWY_INLINE V16h spread_half(const std::uint32_t& doubled) {
  return hn::BitCast(hn::Half<D16>(), hn::Set(hn::Half<D32>(), doubled));
}

// The words of a vector of targets.
struct Window {
  V16 lower0, lower1, upper1, lower2, upper2;
  HWY_INLINE Window(const Targets& t, std::size_t k)
      : lower0(hn::LoadU(D16(), t.lower0 + k)),
        lower1(hn::LoadU(D16(), t.lower1 + k)),
        upper1(hn::LoadU(D16(), t.upper1 + k)),
        lower2(hn::LoadU(D16(), t.lower2 + k)),
        upper2(hn::LoadU(D16(), t.upper2 + k)) {}
};

// The targets of a window that a query may meet. That the target's upper end is not before the
// query's lower end along the sweep axis is left to resolve(): the order makes it nearly always so.
HWY_INLINE hn::Mask<D16> candidates(const Query& q, const Window& t) {
  const V16 a = hn::SaturatedSub(t.lower0, spread(q.upper0));
  const V16 b = hn::SaturatedSub(spread(q.lower1), t.upper1);
  const V16 c = hn::SaturatedSub(t.lower1, spread(q.upper1));
  const V16 e = hn::SaturatedSub(spread(q.lower2), t.upper2);
  const V16 f = hn::SaturatedSub(t.lower2, spread(q.upper2));
  return hn::Eq(hn::Or3(hn::Or3(a, b, c), e, f), hn::Zero(D16()));
}

// Queries that follow each other share their first window, which begins right after the first of
// them: loading it, across cache lines, costs more than comparing.
constexpr std::uint32_t sharing =
    hn::MaxLanes(D16()) >= 16 ? static_cast<std::uint32_t>(hn::MaxLanes(D16()) / 8) : 1;

// The first window of queries begin..end-1 of a strip swept over itself, with no branch between
// them.
HWY_NOINLINE void first_windows(const Strip& strip, const Queries& queries, Hits& hits) {
  const Targets t(strip);
  const std::uint32_t begin = queries.begin, end = queries.end;
  const Query* HWY_RESTRICT q = queries.query;
  hits.count = 0;
  for (std::uint32_t i = begin; i < end; i += sharing) {
    const Window window(t, i + 1);
    for (std::uint32_t g = 0; g < sharing; ++g) {
      // The first g lanes are this query and those before it.
      // Beyond the block's end are no queries.
      const std::uint32_t within = i + g < end ? ~std::uint32_t{0} << g : 0;
      hits.add(i + g, i + 1, bits_of(D16(), candidates(q[i - begin + g], window)) & within);
    }
  }
}

// Those of queries begin..end-1 of a strip swept over itself whose windows go on beyond one vector.
HWY_NOINLINE void open_after_first(const Strip& strip, std::uint32_t begin, std::uint32_t end,
                                   Open& open) {
  const D16 d;
  constexpr std::uint32_t lanes = static_cast<std::uint32_t>(hn::MaxLanes(D16()));
  const auto bucket_start = hn::Set(d, static_cast<std::uint16_t>(~((1u << strip.shift) - 1)));
  const D32 d32;
  constexpr std::uint32_t half = static_cast<std::uint32_t>(hn::MaxLanes(D32()));
  const auto group = hn::Set(d32, ~(sharing - 1));
  // Those whose next window would begin beyond the last target have none.
  const std::uint32_t left = strip.count > 1 + lanes ? strip.count - 1 - lanes : 0;
  const std::uint32_t last = std::min(end, (left + sharing - 1) / sharing * sharing);
  std::uint32_t* to = reinterpret_cast<std::uint32_t*>(open.place);
  for (std::uint32_t i = begin; i < last; i += lanes) {
    // Asked of the earliest target that any of those who share a window goes on at; so one may be
    // opened in vain.
    const V16 next = hn::And(hn::LoadU(d, strip.lower[0] + i + 2 + lanes - sharing), bucket_start);
    const V16 upper = hn::LoadU(d, strip.upper[0] + i);
    std::uint32_t bits = bits_of(d, hn::Eq(hn::SaturatedSub(next, upper), hn::Zero(d)));
    if (last - i < lanes) bits &= (1u << (last - i)) - 1;
    for (std::uint32_t h = 0; h < 2; ++h) {
      const auto query = hn::Iota(d32, i + h * half);
      const auto at = hn::Add(hn::And(query, group), hn::Set(d32, 1 + lanes));
      const std::uint32_t part =
          bits >> (h * half) & static_cast<std::uint32_t>((std::uint64_t{1} << half) - 1);
      store_interleaved(compress(query, part), compress(at, part), to);
      to += 2 * std::popcount(part);
    }
  }
  open.count = static_cast<std::uint32_t>(to - reinterpret_cast<std::uint32_t*>(open.place)) / 2;
}

// One vector further for each open query.
HWY_NOINLINE void next_windows(const Queries& queries, const Strip& targets, Open& open,
                               Hits& hits) {
  constexpr std::uint32_t lanes = static_cast<std::uint32_t>(hn::MaxLanes(D16()));
  const std::uint32_t bucket_start = ~((1u << targets.shift) - 1);
  const Targets t(targets);
  const Query* HWY_RESTRICT q = queries.query;
  const std::uint32_t begin = queries.begin;
  const std::uint32_t target_count = targets.count;
  const std::uint32_t open_count = open.count;
  std::size_t still = 0;
  hits.count = 0;
  for (std::uint32_t o = 0; o < open_count; ++o) {
    const Hits::Place place = open.place[o];
    const Query& query = q[place.query - begin];
    const std::uint32_t bits = bits_of(D16(), candidates(query, Window(t, place.at)));
    hits.add(place.query, place.at, bits);
    const std::uint32_t next = place.at + lanes;
    open.place[still] = {place.query, next};
    // Beyond the last target are words that nothing reaches but 65535: the count decides too.
    still += static_cast<std::size_t>(next < target_count) &
             static_cast<std::size_t>((t.lower0[next] & bucket_start) <= (query.upper0 & 0xffff));
  }
  open.count = static_cast<std::uint32_t>(still);
}

// Splits what was hit into sure pairs and those with equal words, drops pairs whose home is another
// column, and writes them.
template <Orientation orientation>
HWY_NOINLINE void resolve(const Queries& queries, const Strip& targets, const Hits& whole,
                          Emit& out) {
  HalfHits hits;
  hits.take(whole);
  const hn::Half<D16> d;
  const auto zero = hn::Zero(d);
  const Targets t(targets);
  const std::uint16_t* HWY_RESTRICT upper0 = targets.upper[0];
  const std::uint32_t* HWY_RESTRICT ids = targets.id;
  const Query* HWY_RESTRICT query = queries.query;
  const std::uint32_t begin = queries.begin;
  const std::size_t count = hits.count;
  Pair* cursor = out.cursor;
  for (std::size_t h = 0; h < count; ++h) {
    const std::size_t k = hits.place[h].at;
    const Query& q = query[hits.place[h].query - begin];
    const V16h l0 = hn::LoadU(d, t.lower0 + k), u0 = hn::LoadU(d, upper0 + k);
    const V16h l1 = hn::LoadU(d, t.lower1 + k), u1 = hn::LoadU(d, t.upper1 + k);
    const V16h l2 = hn::LoadU(d, t.lower2 + k), u2 = hn::LoadU(d, t.upper2 + k);
    const V16h ql0 = spread_half(q.lower0), ql1 = spread_half(q.lower1),
               ql2 = spread_half(q.lower2);
    const V16h s0 = hn::Min(hn::SaturatedSub(spread_half(q.upper0), l0), hn::SaturatedSub(u0, ql0));
    const V16h s1 = hn::Min(hn::SaturatedSub(spread_half(q.upper1), l1), hn::SaturatedSub(u1, ql1));
    const V16h s2 = hn::Min(hn::SaturatedSub(spread_half(q.upper2), l2), hn::SaturatedSub(u2, ql2));
    // Nonzero: every end is strictly on its side.
    const V16h strict = hn::Min(hn::Min(s0, s1), s2);
    // Nonzero: this column is the home of the pair.
    const V16h home = hn::Min(hn::Max(l0, ql0), hn::Min(hn::Max(l1, ql1), hn::Max(l2, ql2)));
    const std::uint32_t away = bits_of(d, hn::Eq(home, zero));
    const std::uint32_t tie = bits_of(d, hn::Eq(strict, zero));
    const std::uint32_t here = hits.mask[h] & ~away;
    const std::uint32_t sure = here & ~tie;
    cursor = append<orientation>(cursor, q.id, ids + k, sure);
    if (HWY_UNLIKELY(cursor > out.limit)) {
      out.cursor = cursor;
      out.flush(&out);
      cursor = out.cursor;
    }
    if (HWY_UNLIKELY((here & tie) != 0)) {
      // No box ends on word 0: what lies beyond the last target does.
      const std::uint32_t apart = bits_of(d, hn::Gt(hn::Max(ql0, hn::Set(d, 1)), u0));
      const std::uint32_t maybe = here & tie & ~apart;
      Pair* to = append<orientation>(out.maybe_cursor, q.id, ids + k, maybe);
      out.maybe_cursor = to;
      if (HWY_UNLIKELY(to > out.maybe_limit)) {
        out.cursor = cursor;
        out.flush_maybe(&out);
        cursor = out.cursor;
      }
    }
  }
  out.cursor = cursor;
}

template <Orientation orientation>
void sweep_as(const Sweep& args, Emit& out) {
  const Strip& q = *args.queries;
  const Strip& t = *args.targets;
  constexpr std::uint32_t lanes = static_cast<std::uint32_t>(hn::MaxLanes(D16()));
  const std::uint32_t bucket_start = ~((1u << t.shift) - 1);
  Queries block(q.axis);
  Hits hits;
  Open open;
  std::uint64_t vectors = 0;
  for (std::uint32_t begin = 0; begin < q.count; begin += query_block) {
    block.take(q, begin);
    if (args.start) {
      open.count = 0;
      for (std::uint32_t i = begin; i < block.end; ++i) {
        const std::uint32_t k = args.start[i];
        open.place[open.count] = {i, k};
        open.count += k < t.count && (t.lower[0][k] & bucket_start) <= q.upper[0][i];
      }
    } else {
      first_windows(q, block, hits);
      vectors += block.end - begin;
      resolve<orientation>(block, t, hits, out);
      open_after_first(q, begin, block.end, open);
    }
    while (open.count != 0) {
      vectors += open.count;
      next_windows(block, t, open, hits);
      resolve<orientation>(block, t, hits, out);
    }
  }
  out.comparisons += vectors * lanes;
}

inline void sweep(const Sweep& args, Emit& out) {
  switch (args.orientation) {
    case Orientation::unordered:
      return sweep_as<Orientation::unordered>(args, out);
    case Orientation::query_first:
      return sweep_as<Orientation::query_first>(args, out);
    case Orientation::target_first:
      return sweep_as<Orientation::target_first>(args, out);
  }
}

template <Orientation orientation>
void all_pairs_as(const Tile& q, const Tile& t, bool same, Emit& out) {
  const hn::ScalableTag<float> d;
  const std::uint32_t lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  for (std::uint32_t i = 0; i < q.count; ++i) {
    const auto l0 = hn::Set(d, q.corner[0][i]), l1 = hn::Set(d, q.corner[1][i]),
               l2 = hn::Set(d, q.corner[2][i]), u0 = hn::Set(d, q.corner[3][i]),
               u1 = hn::Set(d, q.corner[4][i]), u2 = hn::Set(d, q.corner[5][i]);
    const std::uint32_t first = same ? i + 1 : 0;
    for (std::uint32_t j = first; j < t.count; j += lanes) {
      const auto x = hn::And(hn::Le(l0, hn::LoadU(d, t.corner[3] + j)),
                             hn::Le(hn::LoadU(d, t.corner[0] + j), u0));
      const auto y = hn::And(hn::Le(l1, hn::LoadU(d, t.corner[4] + j)),
                             hn::Le(hn::LoadU(d, t.corner[1] + j), u1));
      const auto z = hn::And(hn::Le(l2, hn::LoadU(d, t.corner[5] + j)),
                             hn::Le(hn::LoadU(d, t.corner[2] + j), u2));
      const auto inside = hn::FirstN(d, t.count - j);
      const std::uint32_t bits = bits_of(d, hn::And(hn::And(x, y), hn::And(z, inside)));
      if (bits == 0) continue;
      out.cursor = append<orientation>(out.cursor, q.id[i], t.id + j, bits);
      if (out.cursor > out.limit) out.flush(&out);
    }
    if (t.count > first) out.comparisons += t.count - first;
  }
}

inline void all_pairs(const Tile& q, const Tile& t, bool same, Orientation orientation, Emit& out) {
  switch (orientation) {
    case Orientation::unordered:
      return all_pairs_as<Orientation::unordered>(q, t, same, out);
    case Orientation::query_first:
      return all_pairs_as<Orientation::query_first>(q, t, same, out);
    case Orientation::target_first:
      return all_pairs_as<Orientation::target_first>(q, t, same, out);
  }
}

}  // namespace throng::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
