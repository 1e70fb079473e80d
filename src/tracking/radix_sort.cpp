#include "tracking/radix_sort.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

namespace throng::tracking {
namespace {

// Sorts each run of pairs with equal first ids.
void sort_runs(LivePair* pairs, std::size_t count) noexcept {
  for (std::size_t i = 1; i < count; ++i) {
    if (pairs[i].first != pairs[i - 1].first) continue;
    const std::size_t begin = i - 1;
    while (i < count && pairs[i].first == pairs[begin].first) ++i;
    std::sort(pairs + begin, pairs + i, pair_less);
  }
}

// Digit width and count for keys below a limit.
struct Digits {
  Digits(std::size_t limit, unsigned most) noexcept {
    const unsigned bits = std::max(1u, static_cast<unsigned>(std::bit_width(limit)));
    passes = (bits + most - 1) / most;
    width = (bits + passes - 1) / passes;
  }
  unsigned passes, width;
};
constexpr unsigned max_width = 11;
// Small inputs use small digits, as clearing the counters costs as much as sorting.
constexpr std::size_t small_count = 4096;
constexpr unsigned small_width = 7;

// LSD radix sort by all digits of number_of; swaps the two buffers after each pass.
template <class T, class Number>
void sort_by(T*& from, T*& to, std::size_t count, const Digits& digits, Number&& number_of) {
  const std::size_t values = std::size_t{1} << digits.width;
  for (unsigned pass = 0; pass < digits.passes; ++pass) {
    const auto digit_of = [&](const T& x) {
      return (number_of(x) >> (pass * digits.width)) & (values - 1);
    };
    std::uint32_t counts[1 << max_width];
    std::memset(counts, 0, values * sizeof *counts);
    for (std::size_t i = 0; i < count; ++i) ++counts[digit_of(from[i])];
    std::exclusive_scan(counts, counts + values, counts, 0u);
    for (std::size_t i = 0; i < count; ++i) to[counts[digit_of(from[i])]++] = from[i];
    std::swap(from, to);
  }
}

}  // namespace

void sort_pairs(LivePair* pairs, LivePair* scratch, std::size_t count, std::size_t limit) noexcept {
  if (count < radix_sort_threshold) return std::sort(pairs, pairs + count, pair_less);
  const Digits digits(limit, count < small_count ? small_width : max_width);
  LivePair* from = pairs;
  LivePair* to = scratch;
  // Small inputs by first alone: hardly any share one.
  if (count >= small_count)
    sort_by(from, to, count, digits, [](const LivePair& p) { return p.second; });
  sort_by(from, to, count, digits, [](const LivePair& p) { return p.first; });
  if (from != pairs) std::memcpy(pairs, from, count * sizeof *pairs);
  if (count < small_count) sort_runs(pairs, count);
}

void sort_hits(SweepHit* hits, SweepHit* scratch, std::size_t count, std::size_t limit) noexcept {
  if (count < radix_sort_threshold) {
    return std::sort(hits, hits + count,
                     [](const SweepHit& a, const SweepHit& b) { return a.object < b.object; });
  }
  SweepHit* from = hits;
  SweepHit* to = scratch;
  sort_by(from, to, count, Digits(limit, count < small_count ? small_width : max_width),
          [](const SweepHit& hit) { return hit.object; });
  if (from != hits) std::memcpy(hits, from, count * sizeof *hits);
}

}  // namespace throng::tracking
