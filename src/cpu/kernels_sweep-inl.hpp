// The sweep over vectors: each box against vectors of those that follow it in the order, as far as
// its window goes. Included once an instruction set.
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

#include "cpu/kernels_compare-inl.hpp"
#include "cpu/kernels_emit-inl.hpp"
#include "cpu/kernels_sides-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t id_lane_bits = (std::uint32_t{1} << hn::MaxLanes(D32())) - 1;
// Queries are taken in blocks, so that the lists of a block stay in the first level of cache.
constexpr std::uint32_t query_block = 256;

// Queries that overlap some of the vector of targets at `at`.
struct Hits {
  Window place[query_block + 8];
  std::uint32_t mask[query_block + 8];
  std::size_t count = 0;
};

// Queries that follow each other share their first window, which begins right after the first of
// them: loading it, across cache lines, costs more than comparing.
constexpr std::uint32_t sharing = word_lanes / 8;
// So many of them go on together; fewer go on alone.
constexpr std::uint32_t least_together = sharing / 2 + 1;

template <Orientation orientation>
class StripSweep {
 public:
  StripSweep(const Strip& queries, const Strip& targets, Emit& out);

  // `start`: null where a strip is swept over itself.
  template <bool ordered>
  void run(const std::uint32_t* start);
  std::uint64_t comparisons() const { return (vectors_ + sides_.vectors()) * word_lanes; }

 private:
  void take(std::uint32_t begin);
  template <bool ordered>
  void first_windows();
  void go_on(std::uint32_t first, std::uint32_t members, std::uint32_t at, std::uint32_t& singles,
             std::uint32_t& groups);
  void open_after_first();
  void open_at(const std::uint32_t* start);
  template <bool ordered>
  void look(std::uint32_t query, const Targets& window, std::uint32_t at, std::uint32_t lanes,
            std::size_t& hit);
  template <bool ordered>
  void next_windows();
  void defer(const Query& query, std::uint32_t at, std::uint32_t bits);
  void write();

  const Strip& queries_;
  const Strip& targets_;
  Emit& out_;
  std::uint32_t begin_ = 0, end_ = 0;  // the block
  std::uint64_t vectors_ = 0;
  Hits hits_;
  SideBySide<orientation> sides_;
  // Those whose windows go on: alone, and by the first of those who share them.
  Window singles_[query_block + 8], groups_[query_block + 8];
  std::uint32_t single_count_ = 0, group_count_ = 0;
  std::uint8_t bytes_[32];
  Query query_[query_block + 8];  // some more are written and read, and not used
};

template <Orientation orientation>
StripSweep<orientation>::StripSweep(const Strip& queries, const Strip& targets, Emit& out)
    : queries_(queries), targets_(targets), out_(out), sides_(queries, out) {
  const std::uint32_t axis = queries.axis;
  const auto lower = [&](std::uint32_t k) { return 2 * ((axis + k) % 3); };
  const auto upper = [&](std::uint32_t k) { return 6 + 2 * ((axis + k) % 3); };
  const std::uint32_t words[6] = {upper(0), lower(1), upper(1), lower(2), upper(2), lower(0)};
  for (std::uint32_t b = 0; b < 24; ++b)
    bytes_[b] = static_cast<std::uint8_t>(words[b / 4] + b % 2);
  for (std::uint32_t b = 24; b < 28; ++b) bytes_[b] = static_cast<std::uint8_t>(12 + b % 4);
  for (std::uint32_t b = 28; b < 32; ++b) bytes_[b] = 128;
}

// Blocks of 128 bits: low 0, high 0, low 1, high 1, ...
template <class V>
HWY_INLINE void store_blocks_interleaved(V low, V high, std::uint64_t* to) {
  const hn::DFromV<V> d;
#if HWY_TARGET == HWY_AVX3
  const __m512i even = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
  const __m512i odd = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
  hn::StoreU(V{_mm512_permutex2var_epi64(low.raw, even, high.raw)}, d, to);
  hn::StoreU(V{_mm512_permutex2var_epi64(low.raw, odd, high.raw)}, d, to + 8);
#elif HWY_TARGET == HWY_AVX2
  hn::StoreU(hn::ConcatLowerLower(d, high, low), d, to);
  hn::StoreU(hn::ConcatUpperUpper(d, high, low), d, to + 4);
#else
  hn::StoreU(low, d, to);
  hn::StoreU(high, d, to + 2);
#endif
}

// The queries of the block from `begin` on, made of their records by a shuffle of bytes for each
// half.
template <Orientation orientation>
HWY_NOINLINE void StripSweep<orientation>::take(std::uint32_t begin) {
  begin_ = begin;
  end_ = begin + query_block < queries_.count ? begin + query_block : queries_.count;
  const hn::ScalableTag<std::uint8_t> d;
  const hn::Repartition<std::uint64_t, decltype(d)> d64;
  constexpr std::uint32_t group = static_cast<std::uint32_t>(hn::MaxLanes(d)) / sizeof(Record);
  const hn::Repartition<std::uint16_t, decltype(d)> d16;
  alignas(16) static constexpr std::uint16_t bits[8] = {1, 2, 4, 0, 0, 0, 0, 0};
  alignas(16) static constexpr std::uint8_t last_word[16] = {128, 128, 128, 128, 128, 128, 128, 128,
                                                             128, 128, 128, 128, 0,   1,   0,   1};
  const auto axis_bits = hn::LoadDup128(d16, bits);
  const auto begins = hn::LoadDup128(d, last_word);
  const auto first = hn::LoadDup128(d, bytes_), second = hn::LoadDup128(d, bytes_ + 16);
  for (std::uint32_t i = begin_; i < end_; i += group) {
    const auto records = hn::LoadU(d, reinterpret_cast<const std::uint8_t*>(queries_.record + i));
    const auto low = hn::BitCast(d64, hn::TableLookupBytes(records, first));
    // A bit for each lower word of 0, added up and put into both halves of the last word.
    const auto zero = hn::Eq(hn::BitCast(d16, records), hn::Zero(d16));
    const auto sum = hn::SumsOf8(hn::BitCast(d, hn::IfThenElseZero(zero, axis_bits)));
    const auto high = hn::Or(hn::TableLookupBytesOr0(records, second),
                             hn::TableLookupBytesOr0(hn::BitCast(d, sum), begins));
    store_blocks_interleaved(low, hn::BitCast(d64, high),
                             reinterpret_cast<std::uint64_t*>(query_ + (i - begin_)));
  }
  if (queries_.framed) {
    for (std::uint32_t i = begin_; i < end_; ++i) {
      query_[i - begin_].begins = static_cast<std::uint16_t>(queries_.begins[i]) * 0x10001u;
      query_[i - begin_].id = queries_.id[i];
    }
  }
  // Those who share the last window but are not there meet nothing.
  constexpr Query none = {~0u, 0, ~0u, 0, ~0u, 0, 0, 0};
  for (std::uint32_t i = end_ - begin_, to = i + sharing; i < to; ++i) query_[i] = none;
}

// Equal words: the pairs that the floats must decide.
template <Orientation orientation>
HWY_NOINLINE void StripSweep<orientation>::defer(const Query& query, std::uint32_t at,
                                                 std::uint32_t bits) {
  for (; bits != 0; bits &= bits - 1) {
    const std::uint32_t lane = static_cast<std::uint32_t>(std::countr_zero(bits));
    *out_.maybe_cursor++ = make_pair(orientation, query.id, targets_.id[at + lane]);
  }
  if (out_.maybe_cursor > out_.maybe_limit) out_.flush_maybe(&out_);
}

// One query against a vector of targets.
template <Orientation orientation>
template <bool ordered>
HWY_INLINE void StripSweep<orientation>::look(std::uint32_t query, const Targets& window,
                                              std::uint32_t at, std::uint32_t lanes,
                                              std::size_t& hit) {
  std::uint32_t tie;
  std::uint32_t bits = compare<ordered>(query_[query], window, lanes, tie);
  if (HWY_UNLIKELY(tie != 0)) {
    defer(query_[query], at, tie);
    bits &= ~tie;
  }
  // Without a branch: what is empty is overwritten.
  hits_.place[hit] = {query, at};
  hits_.mask[hit] = bits;
  hit += bits != 0;
}

// The first window of each query of the block, with no branch between them.
template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE void StripSweep<orientation>::first_windows() {
  const Strip t = targets_;
  const std::uint32_t begin = begin_, end = end_;
  std::size_t hit = 0;
  for (std::uint32_t i = begin; i < end; i += sharing) {
    const Targets window(t, i + 1);
    for (std::uint32_t g = 0; g < sharing; ++g) {
      // The first g lanes are this query and those before it.
      look<ordered>(i - begin + g, window, i + 1, ~std::uint32_t{0} << g, hit);
    }
  }
  hits_.count = hit;
  vectors_ += end - begin;
}

// Lists the windows that go on at `at`: of those who share them from the query `first` on, the ones
// that `members` names.
template <Orientation orientation>
HWY_INLINE void StripSweep<orientation>::go_on(std::uint32_t first, std::uint32_t members,
                                               std::uint32_t at, std::uint32_t& singles,
                                               std::uint32_t& groups) {
  const bool together = static_cast<std::uint32_t>(std::popcount(members)) >= least_together;
  groups_[groups] = {first, at};
  groups += together;
  for (std::uint32_t g = 0; g < sharing; ++g) {
    singles_[singles] = {first + g, at};
    singles += (members >> g & 1) & !together;
  }
}

// Those whose windows go on beyond the first vector.
template <Orientation orientation>
HWY_NOINLINE void StripSweep<orientation>::open_after_first() {
  const D16 d;
  const Strip& strip = queries_;
  const auto bucket_start = hn::Set(d, static_cast<std::int16_t>(-(1 << strip.shift)));
  // Those whose next window would begin beyond the last target have none.
  const std::uint32_t left = strip.count > 1 + word_lanes ? strip.count - 1 - word_lanes : 0;
  const std::uint32_t last = std::min(end_, (left + sharing - 1) / sharing * sharing);
  std::uint32_t singles = 0, groups = 0;
  for (std::uint32_t i = begin_; i < last; i += word_lanes) {
    // Asked of the earliest target that any of those who share a window goes on at; so one may be
    // opened in vain.
    const auto next =
        hn::And(hn::LoadU(d, strip.lower[0] + i + 2 + word_lanes - sharing), bucket_start);
    std::uint32_t bits = bits_of(d, hn::Not(hn::Gt(next, hn::LoadU(d, strip.upper[0] + i))));
    if (last - i < word_lanes) bits &= (1u << (last - i)) - 1;
    for (std::uint32_t first = i; bits != 0; first += sharing, bits >>= sharing) {
      const std::uint32_t members = bits & ((1u << sharing) - 1);
      go_on(first - begin_, members, first + 1 + word_lanes, singles, groups);
    }
  }
  single_count_ = singles;
  group_count_ = groups;
}

// Those that have any target from their start on.
template <Orientation orientation>
void StripSweep<orientation>::open_at(const std::uint32_t* start) {
  const int bucket_start = -(1 << targets_.shift);
  std::uint32_t count = 0;
  for (std::uint32_t i = begin_; i < end_; ++i) {
    const std::uint32_t k = start[i];
    singles_[count] = {i - begin_, k};
    count += k < targets_.count && (targets_.lower[0][k] & bucket_start) <= queries_.upper[0][i];
  }
  single_count_ = count;
}

// One vector further for each window that goes on.
template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE void StripSweep<orientation>::next_windows() {
  const Strip t = targets_;
  const int bucket_start = -(1 << t.shift);
  std::size_t hit = 0;
  // Beyond the last target lies a word that no other is above: the count decides too.
  const auto goes_on = [&](std::uint32_t at, std::uint32_t upper) {
    return static_cast<std::uint32_t>(at < t.count) &
           static_cast<std::uint32_t>((t.lower[0][at] & bucket_start) <=
                                      static_cast<std::int16_t>(upper));
  };
  vectors_ += group_count_ * sharing + single_count_;
  std::uint32_t singles = 0, groups = 0;
  for (std::uint32_t o = 0; o < single_count_; ++o) {
    const Window place = singles_[o];
    look<ordered>(place.query, Targets(t, place.at), place.at, ~std::uint32_t{0}, hit);
    const std::uint32_t next = place.at + word_lanes;
    singles_[singles] = {place.query, next};
    singles += goes_on(next, query_[place.query].upper0);
  }
  for (std::uint32_t o = 0; o < group_count_; ++o) {
    const Window place = groups_[o];
    const Targets window(t, place.at);
    const std::uint32_t next = place.at + word_lanes;
    std::uint32_t members = 0;
    for (std::uint32_t g = 0; g < sharing; ++g) {
      look<ordered>(place.query + g, window, place.at, ~std::uint32_t{0}, hit);
      members |= goes_on(next, query_[place.query + g].upper0) << g;
    }
    go_on(place.query, members, next, singles, groups);
  }
  single_count_ = singles;
  group_count_ = groups;
  hits_.count = hit;
}

// The pairs of all hits: of each a vector of ids from its first target on; what that leaves waits
// for the next round.
template <Orientation orientation>
HWY_NOINLINE void StripSweep<orientation>::write() {
  const D32 d;
  const std::uint32_t* HWY_RESTRICT ids = targets_.id;
  Pair* cursor = out_.cursor;
  Pair* limit = out_.limit;
  for (std::size_t count = hits_.count, rest = 0; count != 0; count = rest) {
    rest = 0;
    for (std::size_t h = 0; h < count; ++h) {
      const Window p = hits_.place[h];
      const std::uint32_t mask = hits_.mask[h];
      const int lane = std::countr_zero(mask);
      const std::uint32_t bits = mask >> lane & id_lane_bits;
      const std::uint32_t left = mask ^ bits << lane;
      hits_.place[rest] = p;
      hits_.mask[rest] = left;
      rest += left != 0;
      const int found = std::popcount(bits);
      const auto target = compress(hn::LoadU(d, ids + p.at + lane), bits);
      store_pairs<orientation>(hn::Set(d, query_[p.query].id), target, found, cursor);
      cursor += found;
      if (HWY_UNLIKELY(cursor > limit)) {
        out_.cursor = cursor;
        out_.flush(&out_);
        cursor = out_.cursor;
        limit = out_.limit;
      }
    }
  }
  out_.cursor = cursor;
}

template <Orientation orientation>
template <bool ordered>
void StripSweep<orientation>::run(const std::uint32_t* start) {
  for (std::uint32_t begin = 0; begin < queries_.count; begin += query_block) {
    if (start) {
      take(begin);
      open_at(start);
    } else if constexpr (word_lanes <= 16) {
      const std::uint32_t end = std::min(begin + query_block, queries_.count);
      single_count_ = sides_.template run<ordered>(begin, end, singles_);
      if (single_count_ != 0) take(begin);
    } else {
      take(begin);
      first_windows<ordered>();
      write();
      open_after_first();
    }
    while (single_count_ + group_count_ != 0) {
      next_windows<ordered>();
      write();
    }
  }
}

template <Orientation orientation>
void sweep_as(const Sweep& args, Emit& out) {
  StripSweep<orientation> sweep(*args.queries, *args.targets, out);
  if (!args.start && args.targets->long_boxes) {
    sweep.template run<true>(nullptr);
  } else {
    sweep.template run<false>(args.start);
  }
  out.comparisons += sweep.comparisons();
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

}  // namespace throng::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
