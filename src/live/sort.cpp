#include "live/sort.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

namespace throng::live {
namespace {

// Sorts each run of pairs with equal first ids.
void sort_runs(LivePair* pairs, std::size_t count) noexcept {
  for (std::size_t i = 1; i < count; ++i) {
    if (pairs[i].first != pairs[i - 1].first) continue;
    const std::size_t begin = i - 1;
    while (i < count && pairs[i].first == pairs[begin].first) ++i;
    std::sort(pairs + begin, pairs + i, before);
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
constexpr unsigned most_width = 11;
// Small inputs use small digits, as clearing the counters costs as much as sorting.
constexpr std::size_t few = 4096;
constexpr unsigned few_width = 7;

// LSD radix sort by all digits of number_of; swaps the two buffers after each pass.
template <class T, class Number>
void sort_by(T*& from, T*& to, std::size_t count, const Digits& digits, Number&& number_of) {
  const std::size_t values = std::size_t{1} << digits.width;
  for (unsigned pass = 0; pass < digits.passes; ++pass) {
    const auto digit_of = [&](const T& x) {
      return (number_of(x) >> (pass * digits.width)) & (values - 1);
    };
    std::uint32_t counts[1 << most_width];
    std::memset(counts, 0, values * sizeof *counts);
    for (std::size_t i = 0; i < count; ++i) ++counts[digit_of(from[i])];
    std::exclusive_scan(counts, counts + values, counts, 0u);
    for (std::size_t i = 0; i < count; ++i) to[counts[digit_of(from[i])]++] = from[i];
    std::swap(from, to);
  }
}

}  // namespace

void sort_pairs(LivePair* pairs, LivePair* spare, std::size_t count, std::size_t limit) noexcept {
  if (count < few_to_sort) return std::sort(pairs, pairs + count, before);
  const Digits digits(limit, count < few ? few_width : most_width);
  LivePair* from = pairs;
  LivePair* to = spare;
  // Small inputs by first alone: hardly any share one.
  if (count >= few) sort_by(from, to, count, digits, [](const LivePair& p) { return p.second; });
  sort_by(from, to, count, digits, [](const LivePair& p) { return p.first; });
  if (from != pairs) std::memcpy(pairs, from, count * sizeof *pairs);
  if (count < few) sort_runs(pairs, count);
}

void sort_hits(SweepHit* hits, SweepHit* spare, std::size_t count, std::size_t limit) noexcept {
  if (count < few_to_sort) {
    return std::sort(hits, hits + count,
                     [](const SweepHit& a, const SweepHit& b) { return a.object < b.object; });
  }
  SweepHit* from = hits;
  SweepHit* to = spare;
  sort_by(from, to, count, Digits(limit, count < few ? few_width : most_width),
          [](const SweepHit& hit) { return hit.object; });
  if (from != hits) std::memcpy(hits, from, count * sizeof *hits);
}

}  // namespace throng::live
