// The sweep over vectors. A strip against itself: along diagonals (kernels_sweep_diagonal-inl.hpp),
// or by broadcast where windows are long (kernels_sweep_broadcast-inl.hpp). Queries with far longer
// windows than their neighbours, and queries of another strip, go one by one against vectors of
// targets. Included once per instruction set.
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

#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/kernels_box_test-inl.hpp"
#include "grid/sweep/kernels_sweep_broadcast-inl.hpp"
#include "grid/sweep/kernels_sweep_diagonal-inl.hpp"
#include "grid/sweep/kernels_transpose-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t id_lane_bits = (std::uint32_t{1} << hn::MaxLanes(D32())) - 1;
// Queries that overlap some of the vector of targets at `at`.
struct WindowHits {
  Window place[query_block + 8];
  std::uint32_t mask[query_block + 8];
  std::size_t count = 0;
};

template <Orientation orientation>
class StripSweep {
 public:
  StripSweep(const Strip& queries, const Strip& targets, Emit& out);

  // args.start: null where a strip is swept against itself.
  template <bool ordered>
  void run(const SweepArgs& args);
  std::uint64_t comparisons() const {
    return (vectors_ + broadcast_sweep_.vectors()) * quantized_lanes +
           diagonal_sweep_.vectors() * diagonal_lanes;
  }

 private:
  void load_queries();
  void open_windows(const std::uint32_t* start);
  template <bool ordered>
  void sweep_self();
  template <bool ordered>
  void advance_windows();
  void collect_ties(const Query& query, std::uint32_t at, std::uint32_t bits);
  void write();

  const Strip& queries_;
  const Strip& targets_;
  Emit& out_;
  std::uint32_t begin_ = 0, end_ = 0;  // the block
  std::uint64_t vectors_ = 0;
  WindowHits hits_;
  DiagonalSweep<orientation> diagonal_sweep_;
  BroadcastSweep<orientation> broadcast_sweep_;
  Window windows_[query_block + 8];  // those not finished
  std::uint32_t count_ = 0;
  Query query_[query_block + 8];  // padding is written and read, but not used
};

template <Orientation orientation>
StripSweep<orientation>::StripSweep(const Strip& queries, const Strip& targets, Emit& out)
    : queries_(queries),
      targets_(targets),
      out_(out),
      diagonal_sweep_(queries, out),
      broadcast_sweep_(queries, out) {}

// Shuffle masks from a record's bytes to a query's, per sweep axis.
struct QueryBytes {
  alignas(16) std::uint8_t of[3][32] = {};
  constexpr QueryBytes() {
    for (unsigned axis = 0; axis < 3; ++axis) {
      const auto lower = [&](unsigned k) { return 2 * ((axis + k) % 3); };
      const auto upper = [&](unsigned k) { return 6 + 2 * ((axis + k) % 3); };
      const unsigned words[6] = {upper(0), lower(1), upper(1), lower(2), upper(2), lower(0)};
      for (unsigned b = 0; b < 24; ++b)
        of[axis][b] = static_cast<std::uint8_t>(words[b / 4] + b % 2);
      for (unsigned b = 24; b < 28; ++b) of[axis][b] = static_cast<std::uint8_t>(12 + b % 4);
      for (unsigned b = 28; b < 32; ++b) of[axis][b] = 128;
    }
  }
};
inline constexpr QueryBytes query_bytes;

// Stores 128-bit blocks: low 0, high 0, low 1, high 1, ...
template <class V>
HWY_INLINE void store_blocks_interleaved(V low, V high, std::uint64_t* to) {
  const hn::DFromV<V> d;
#if HWY_TARGET == HWY_AVX3_DL
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

// Makes the queries of the open windows (in order), and of the others in the same vector of
// records, from records: one byte shuffle per half.
template <Orientation orientation>
HWY_NOINLINE void StripSweep<orientation>::load_queries() {
  const hn::ScalableTag<std::uint8_t> d;
  const hn::Repartition<std::uint64_t, decltype(d)> d64;
  constexpr std::uint32_t group = static_cast<std::uint32_t>(hn::MaxLanes(d)) / sizeof(Record);
  const hn::Repartition<std::uint16_t, decltype(d)> d16;
  alignas(16) static constexpr std::uint16_t bits[8] = {1, 2, 4, 0, 0, 0, 0, 0};
  alignas(16) static constexpr std::uint8_t last_word[16] = {128, 128, 128, 128, 128, 128, 128, 128,
                                                             128, 128, 128, 128, 0,   1,   0,   1};
  const auto axis_bits = hn::LoadDup128(d16, bits);
  const auto reject_bits_shuffle = hn::LoadDup128(d, last_word);
  const std::uint8_t* const bytes = query_bytes.of[queries_.axis];
  const auto first = hn::LoadDup128(d, bytes), second = hn::LoadDup128(d, bytes + 16);
  for (std::uint32_t o = 0, taken = 0; o < count_; ++o) {
    if (windows_[o].query < taken) continue;
    const std::uint32_t q = windows_[o].query / group * group;
    taken = q + group;
    const auto records = load_records<1>(d, queries_.record + begin_ + q);
    const auto low = hn::BitCast(d64, look_up_bytes(records, first));
    // One bit per lower coordinate of 0, summed and stored in both halves of the last value.
    const auto zero = hn::Eq(hn::BitCast(d16, records), hn::Zero(d16));
    const auto sum = hn::SumsOf8(hn::BitCast(d, hn::IfThenElseZero(zero, axis_bits)));
    const auto high = hn::Or(look_up_bytes(records, second),
                             look_up_bytes(hn::BitCast(d, sum), reject_bits_shuffle));
    store_blocks_interleaved(low, hn::BitCast(d64, high),
                             reinterpret_cast<std::uint64_t*>(query_ + q));
  }
  if (queries_.has_overrides) {
    for (std::uint32_t o = 0; o < count_; ++o) {
      const std::uint32_t q = windows_[o].query;
      query_[q].query_reject_bits =
          static_cast<std::uint16_t>(queries_.query_reject_bits[begin_ + q]) * 0x10001u;
      query_[q].id = queries_.id[begin_ + q];
    }
  }
}

// Collects ties for the floats to decide.
template <Orientation orientation>
HWY_NOINLINE void StripSweep<orientation>::collect_ties(const Query& query, std::uint32_t at,
                                                        std::uint32_t bits) {
  for (; bits != 0; bits &= bits - 1) {
    const std::uint32_t lane = static_cast<std::uint32_t>(std::countr_zero(bits));
    *out_.tie_cursor++ =
        make_pair(orientation, query.id, targets_.id[at + lane], out_.target_id_offset);
  }
  if (out_.tie_cursor > out_.tie_limit) out_.flush_ties(&out_);
}

// Opens the windows that have any target from their start on.
template <Orientation orientation>
void StripSweep<orientation>::open_windows(const std::uint32_t* start) {
  const int bucket_start = -(1 << targets_.shift);
  std::uint32_t count = 0;
  for (std::uint32_t i = begin_; i < end_; ++i) {
    const std::uint32_t k = start[i];
    windows_[count] = {i - begin_, k};
    count += k < targets_.count && (targets_.lower[0][k] & bucket_start) <= queries_.upper[0][i];
  }
  count_ = count;
}

// A strip against itself: sweeps queries together where that pays, and opens the windows that
// remain.
template <Orientation orientation>
template <bool ordered>
void StripSweep<orientation>::sweep_self() {
  count_ = 0;
  if (broadcast_sweep_.pays_off(begin_, end_)) {
    for (std::uint32_t i = begin_; i < end_; i += broadcast_queries)
      broadcast_sweep_.template run<ordered>(i, begin_, windows_, count_);
    broadcast_sweep_.write();
  } else {
    diagonal_sweep_.template run<ordered>(begin_, end_, windows_, count_);
    diagonal_sweep_.write();
  }
}

// Advances each open window by one vector.
template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE void StripSweep<orientation>::advance_windows() {
  const Strip t = targets_;
  const int bucket_start = -(1 << t.shift);
  std::size_t hit = 0;
  vectors_ += count_;
  std::uint32_t open_count = 0;
  for (std::uint32_t o = 0; o < count_; ++o) {
    const Window place = windows_[o];
    const Query& query = query_[place.query];
    std::uint32_t tie;
    std::uint32_t bits = compare<ordered>(query, Targets(t, place.at), tie);
    if (HWY_UNLIKELY(tie != 0)) {
      collect_ties(query, place.at, tie);
      bits &= ~tie;
    }
    // Branch-free: an empty entry is overwritten.
    hits_.place[hit] = place;
    hits_.mask[hit] = bits;
    hit += bits != 0;
    // The padding's lower coordinate is the maximum, so the count must decide too.
    const std::uint32_t next = place.at + quantized_lanes;
    windows_[open_count] = {place.query, next};
    open_count += static_cast<std::uint32_t>(next < t.count) &
                  static_cast<std::uint32_t>((t.lower[0][next] & bucket_start) <=
                                             static_cast<std::int16_t>(query.upper0));
  }
  count_ = open_count;
  hits_.count = hit;
}

// Writes the pairs of all hits.
template <Orientation orientation>
HWY_NOINLINE void StripSweep<orientation>::write() {
  const D32 d;
  const std::uint32_t* HWY_RESTRICT ids = targets_.id;
  PairWriter<orientation> pairs(out_);
#if HWY_TARGET == HWY_AVX3_DL
  for (std::size_t h = 0; h < hits_.count; ++h) {
    const Window p = hits_.place[h];
    const V32 query = hn::Set(d, query_[p.query].id);
    const V32 low = hn::LoadU(d, ids + p.at), high = hn::LoadU(d, ids + p.at + 16);
    for_each_set_bit(hits_.mask[h], [&](V32 place, int count) HWY_ATTR {
      pairs.put(query, V32{_mm512_permutex2var_epi32(low.raw, place.raw, high.raw)}, count);
    });
  }
#else
  // One vector of ids per hit and round; the remaining bits go to the next round.
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
      pairs.put(hn::Set(d, query_[p.query].id), compress(hn::LoadU(d, ids + p.at + lane), bits),
                std::popcount(bits));
    }
  }
#endif
}

template <Orientation orientation>
template <bool ordered>
void StripSweep<orientation>::run(const SweepArgs& args) {
  static_assert(sweep_piece % query_block == 0);
  const std::uint32_t last = std::min(args.end, queries_.count);
  for (begin_ = args.begin; begin_ < last; begin_ += query_block) {
    end_ = std::min(begin_ + query_block, last);
    if (args.start)
      open_windows(args.start);
    else
      sweep_self<ordered>();
    if (count_ == 0) continue;
    load_queries();
    while (count_ != 0) {
      advance_windows<ordered>();
      write();
    }
  }
}

template <Orientation orientation>
void sweep_as(const SweepArgs& args, Emit& out) {
  StripSweep<orientation> sweep(*args.queries, *args.targets, out);
  if (!args.start && args.targets->long_boxes) {
    sweep.template run<true>(args);
  } else {
    sweep.template run<false>(args);
  }
  out.comparisons += sweep.comparisons();
}

inline void sweep(const SweepArgs& args, Emit& out) {
  switch (args.orientation) {
    case Orientation::unordered:
      return sweep_as<Orientation::unordered>(args, out);
    case Orientation::query_first:
      return sweep_as<Orientation::query_first>(args, out);
    case Orientation::target_first:
      return sweep_as<Orientation::target_first>(args, out);
  }
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
