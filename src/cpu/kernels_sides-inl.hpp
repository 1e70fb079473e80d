// The sweep of a strip over itself by vectors of up to 16 words: as many queries side by side, each
// against the target so many places behind it. Included once an instruction set.
//
// No word is spread over a vector, and a window may end at any place. With longer vectors it waits
// for the longest of more windows, and most of its loads cross a cache line: there one query goes
// against a vector of targets.
#if defined(THRONG_KERNELS_SIDES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_SIDES_INL
#undef THRONG_KERNELS_SIDES_INL
#else
#define THRONG_KERNELS_SIDES_INL
#endif

#include <hwy/highway.h>

#include <bit>

#include "cpu/kernels_compare-inl.hpp"
#include "cpu/kernels_emit-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D8 = hn::Repartition<std::int8_t, D16>;

// The words of a, then those of b, as bytes of the same sign; zero stays zero.
HWY_INLINE hn::Vec<D8> narrow(V16 a, V16 b) {
#if HWY_TARGET == HWY_AVX2
  return hn::Vec<D8>{_mm256_permute4x64_epi64(_mm256_packs_epi16(a.raw, b.raw), 0xd8)};
#else
  const hn::Half<D8> half;
  return hn::Combine(D8(), hn::DemoteTo(half, b), hn::DemoteTo(half, a));
#endif
}

template <Orientation orientation>
class SideBySide {
 public:
  SideBySide(const Strip& strip, Emit& out) : strip_(strip), out_(out) {}

  // The queries from `begin` on, before `end`. Where few of those side by side go on for long, what
  // is left of their windows is listed in `rest`, each by its place from `begin` on; returns how
  // many.
  template <bool ordered>
  std::uint32_t run(std::uint32_t begin, std::uint32_t end, Window* rest);
  std::uint64_t vectors() const { return vectors_; }

 private:
  static constexpr std::size_t steps = 4;  // targets that are compared before the next branch
  static constexpr std::size_t room = 256;

  void defer(const V16 (&least)[steps], std::size_t first, std::size_t at);
  void write();

  const Strip& strip_;
  Emit& out_;
  std::uint64_t vectors_ = 0;
  // Hits: the first query in the low half and its first target in the high half; and a bit for
  // each step and query.
  std::size_t count_ = 0;
  std::uint64_t place_[room], met_[room];
};

// Equal words: the pairs that the floats must decide.
template <Orientation orientation>
HWY_NOINLINE void SideBySide<orientation>::defer(const V16 (&least)[steps], std::size_t first,
                                                 std::size_t at) {
  const D16 d;
  for (std::size_t k = 0; k < steps; ++k) {
    std::uint32_t ties = bits_of(d, hn::Eq(least[k], hn::Zero(d)));
    for (; ties != 0; ties &= ties - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(ties));
      *out_.maybe_cursor++ =
          make_pair(orientation, strip_.id[first + lane], strip_.id[at + k + lane]);
    }
    if (out_.maybe_cursor > out_.maybe_limit) out_.flush_maybe(&out_);
  }
}

template <Orientation orientation>
template <bool ordered>
HWY_NOINLINE std::uint32_t SideBySide<orientation>::run(std::uint32_t begin, std::uint32_t end,
                                                        Window* rest) {
  const D16 d;
  const D8 d8;
  const hn::Repartition<std::uint8_t, D16> du8;
  const std::int16_t* const lower0 = strip_.lower[0];
  const std::int16_t* const upper0 = strip_.upper[0];
  const std::int16_t* const lower1 = strip_.lower[1];
  const std::int16_t* const upper1 = strip_.upper[1];
  const std::int16_t* const lower2 = strip_.lower[2];
  const std::int16_t* const upper2 = strip_.upper[2];
  const std::int16_t* const begins = strip_.begins;
  const auto bucket_start = hn::Set(d, static_cast<std::int16_t>(-(1 << strip_.shift)));
  const V16 zero = hn::Zero(d);
  const auto apart = hn::Set(d8, -1);
  const std::size_t count = strip_.count;
  std::uint32_t left = 0;
  for (std::size_t i = begin; i < end; i += word_lanes) {
    const V16 q_upper0 = hn::LoadU(d, upper0 + i), q_upper1 = hn::LoadU(d, upper1 + i),
              q_upper2 = hn::LoadU(d, upper2 + i), q_lower1 = hn::LoadU(d, lower1 + i),
              q_lower2 = hn::LoadU(d, lower2 + i), q_begins = hn::LoadU(d, begins + i);
    // As compare() has it: 0 is a tie, and what is below is no pair, or not of this column.
    const auto least = [&](std::size_t t) HWY_ATTR {
      const V16 above = hn::Min(hn::Min(hn::Sub(q_upper0, hn::LoadU(d, lower0 + t)),
                                        hn::Sub(q_upper1, hn::LoadU(d, lower1 + t))),
                                hn::Sub(q_upper2, hn::LoadU(d, lower2 + t)));
      V16 below = hn::Max(hn::Sub(q_lower1, hn::LoadU(d, upper1 + t)),
                          hn::Sub(q_lower2, hn::LoadU(d, upper2 + t)));
      if constexpr (!ordered) {
        below = hn::Max(below, hn::Sub(hn::LoadU(d, lower0 + i), hn::LoadU(d, upper0 + t)));
      }
      const auto elsewhere = hn::Gt(hn::And(q_begins, hn::LoadU(d, begins + t)), zero);
      return hn::Or(hn::Min(above, hn::Sub(zero, below)), hn::VecFromMask(d, elsewhere));
    };
    std::size_t at = i + 1;
    for (;;) {
      const V16 l[steps] = {least(at), least(at + 1), least(at + 2), least(at + 3)};
      const auto low = narrow(l[0], l[1]), high = narrow(l[2], l[3]);
      const auto both = [&](auto&& mask_of) HWY_ATTR {
        return bits_of(d8, mask_of(low)) | std::uint64_t{bits_of(d8, mask_of(high))}
                                               << 2 * word_lanes;
      };
      std::uint64_t met = both([&](auto v) HWY_ATTR { return hn::Gt(v, apart); });
      const auto closest = hn::Min(hn::BitCast(du8, low), hn::BitCast(du8, high));
      if (HWY_UNLIKELY(!hn::AllFalse(du8, hn::Eq(closest, hn::Zero(du8))))) {
        defer(l, i, at);
        met &= ~both([&](auto v) HWY_ATTR { return hn::Eq(v, hn::Zero(d8)); });
      }
      // Without a branch: what is empty is overwritten.
      place_[count_] = i | at << 32;
      met_[count_] = met;
      count_ += met != 0;
      if (HWY_UNLIKELY(count_ == room)) write();
      at += steps;
      if (at >= count) break;
      const auto over =
          hn::Gt(hn::And(hn::LoadU(d, lower0 + at), bucket_start), hn::LoadU(d, upper0 + i));
      if (hn::AllTrue(d, over)) break;
      if (HWY_LIKELY(at - i <= 32)) continue;
      std::uint32_t going = bits_of(d, hn::Not(over));
      if (static_cast<std::size_t>(std::popcount(going)) * 8 >= at - i) continue;
      for (; going != 0; going &= going - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(going));
        rest[left] = {static_cast<std::uint32_t>(i) - begin + lane,
                      static_cast<std::uint32_t>(at) + lane};
        left += at + lane < count;
      }
      break;
    }
    vectors_ += at - i - 1;
  }
  write();
  return left;
}

// The pairs of all hits: of each a vector of ids; what that leaves waits for the next round.
template <Orientation orientation>
HWY_NOINLINE void SideBySide<orientation>::write() {
  const D32 d;
  constexpr unsigned id_lanes = hn::MaxLanes(D32());
  constexpr std::uint64_t group = (std::uint64_t{1} << id_lanes) - 1;
  const std::uint32_t* HWY_RESTRICT ids = strip_.id;
  Pair* cursor = out_.cursor;
  Pair* limit = out_.limit;
  for (std::size_t count = count_, rest = 0; count != 0; count = rest) {
    rest = 0;
    for (std::size_t h = 0; h < count; ++h) {
      const std::uint64_t place = place_[h], met = met_[h];
      const auto bit = static_cast<unsigned>(std::countr_zero(met));
      const unsigned from = bit & ~(id_lanes - 1);
      const auto bits = static_cast<std::uint32_t>(met >> from & group);
      place_[rest] = place;
      met_[rest] = met & ~(group << from);
      rest += met_[rest] != 0;
      const unsigned lane = bit & (word_lanes - id_lanes), step = bit / word_lanes;
      const std::uint32_t* const query = ids + (place & 0xffffffffu) + lane;
      const std::uint32_t* const target = ids + (place >> 32) + lane + step;
      const int found = std::popcount(bits);
      store_pairs<orientation>(compress(hn::LoadU(d, query), bits),
                               compress(hn::LoadU(d, target), bits), found, cursor);
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
  count_ = 0;
}

}  // namespace throng::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
