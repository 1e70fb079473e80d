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

#include "grid/sweep/kernels_sweep_block-inl.hpp"
#include "grid/sweep/kernels_sweep_broadcast-inl.hpp"
#include "grid/sweep/kernels_sweep_diagonal-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <Orientation orientation>
class StripSweep {
 public:
  StripSweep(const Strip& queries, const Strip& targets, PairOutput& out)
      : queries_(queries),
        targets_(targets),
        out_(out),
        diagonal_sweep_(queries, out),
        broadcast_sweep_(queries, out) {}

  // args.start: null where a strip is swept against itself.
  template <bool ordered>
  void run(const SweepArgs& args) {
    static_assert(sweep_piece % query_block == 0);
    const std::uint32_t last = std::min(args.end, queries_.count);
    for (begin_ = args.begin; begin_ < last; begin_ += query_block) {
      end_ = std::min(begin_ + query_block, last);
      windows_.count = 0;
      if (args.start)
        open_windows(args.start);
      else
        sweep_self<ordered>();
      if (windows_.count == 0) continue;
      while (windows_.count != 0) advance_windows<ordered>();
    }
  }
  std::uint64_t comparisons() const {
    return vectors_ * coordinate_lanes + broadcast_sweep_.comparisons() +
           diagonal_sweep_.comparisons();
  }

 private:
  struct OneBox {  // in every lane
    const Strip& s;
    std::size_t i;
    HWY_INLINE V16 load(const std::int16_t* values) const { return hn::Set(D16(), values[i]); }
  };

  // Opens the windows that have any target from their start on.
  void open_windows(const std::uint32_t* start) {
    for (std::uint32_t i = begin_; i < end_; ++i) {
      const std::uint32_t k = start[i];
      windows_.add(i - begin_, k,
                   k < targets_.count && targets_.bucket_start(k) <= queries_.upper[0][i]);
    }
  }

  // A strip against itself: sweeps queries together where that pays; the rests of long windows
  // remain.
  template <bool ordered>
  void sweep_self() {
    if (broadcast_sweep_.pays_off(begin_, end_)) {
      for (std::uint32_t i = begin_; i < end_; i += broadcast_queries)
        broadcast_sweep_.template run<ordered>(i, begin_, windows_);
      broadcast_sweep_.write();
    } else {
      diagonal_sweep_.template run<ordered>(begin_, end_, windows_);
      diagonal_sweep_.write();
    }
  }

  // Advances each open window by one vector of targets.
  template <bool ordered>
  HWY_NOINLINE void advance_windows() {
    const D16 d;
    const Strip s = queries_, t = targets_;
    vectors_ += windows_.count;
    std::uint32_t open_count = 0;
    for (std::uint32_t o = 0; o < windows_.count; ++o) {
      const Window place = windows_.at[o];
      const Queries<D16> query(OneBox{s, begin_ + place.query});
      const ConsecutiveBoxes<D16> targets{t, place.at};
      std::uint32_t ties;
      const std::uint32_t overlaps = overlaps_of_vector(
          d, least_difference<ordered>(query, targets), query.mask, target_mask_of(targets), ties);
      hits_.add(place.query, place.at, overlaps);
      if (HWY_UNLIKELY(ties != 0)) ties_.add(place.query, place.at, ties);
      // The padding's lower coordinate is the maximum, so the count must decide too.
      const std::uint32_t next = place.at + coordinate_lanes;
      windows_.at[open_count] = {place.query, next};
      open_count +=
          static_cast<std::uint32_t>(next < t.count) &
          static_cast<std::uint32_t>(t.bucket_start(next) <= s.upper[0][begin_ + place.query]);
    }
    windows_.count = open_count;
    write<PairState::confirmed>(hits_);
    if (HWY_UNLIKELY(ties_.count != 0)) write<PairState::tie>(ties_);
  }

  // See write_pairs().
  template <PairState state>
  HWY_NOINLINE void write(Hits& hits) {
    const D32 d;
    const std::uint32_t* const ids = targets_.id.data();
    const std::uint32_t* const query_ids = queries_.id.data() + begin_;
#if HWY_TARGET == HWY_AVX3_DL
    write_pairs<orientation, state>(hits, out_, [&](std::size_t first, std::size_t at) HWY_ATTR {
      const V32 query_id = hn::Set(d, query_ids[first]);
      const V32 low = hn::LoadU(d, ids + at), high = hn::LoadU(d, ids + at + 16);
      return [=](V32 place, V32& query, V32& target) HWY_ATTR {
        query = query_id;
        target = V32{_mm512_permutex2var_epi32(low.raw, place.raw, high.raw)};
      };
    });
#else
    const auto pick = [&](std::size_t first, std::size_t at, unsigned from, std::uint32_t bits,
                          V32& query, V32& target) HWY_ATTR {
      query = hn::Set(d, query_ids[first]);
      target = compress(hn::LoadU(d, ids + at + from), bits);
    };
    write_pairs<orientation, state>(hits, out_, pick);
#endif
  }

  const Strip& queries_;
  const Strip& targets_;
  PairOutput& out_;
  std::uint32_t begin_ = 0, end_ = 0;  // the block
  std::uint64_t vectors_ = 0;
  DiagonalSweep<orientation> diagonal_sweep_;
  BroadcastSweep<orientation> broadcast_sweep_;
  Windows windows_;  // those not finished
  Hits hits_, ties_;
  static_assert(query_block <= Hits::capacity);
};

template <Orientation orientation>
void sweep_as(const SweepArgs& args, PairOutput& out) {
  StripSweep<orientation> sweep(*args.queries, *args.targets, out);
  if (!args.start && args.targets->long_boxes) {
    sweep.template run<true>(args);
  } else {
    sweep.template run<false>(args);
  }
  out.comparisons += sweep.comparisons();
}

inline void sweep(const SweepArgs& args, PairOutput& out) {
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
