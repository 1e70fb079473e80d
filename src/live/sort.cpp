#include "live/sort.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

namespace throng::live {
namespace {

// Each run of pairs of one first.
void sort_runs(LivePair* pairs, std::size_t count) noexcept {
  for (std::size_t i = 1; i < count; ++i) {
    if (pairs[i].first != pairs[i - 1].first) continue;
    const std::size_t begin = i - 1;
    while (i < count && pairs[i].first == pairs[begin].first) ++i;
    std::sort(pairs + begin, pairs + i, before);
  }
}

}  // namespace

void sort_pairs(LivePair* pairs, LivePair* spare, std::size_t count, std::size_t limit) noexcept {
  if (count < 48) return std::sort(pairs, pairs + count, before);
  // From the last digit up. Few pairs by small digits, as the counters cost what pairs do, and by
  // first alone: hardly two have the same one.
  const bool few = count < 4096;
  const unsigned bits = std::max(1u, static_cast<unsigned>(std::bit_width(limit)));
  const unsigned most = few ? 7 : 11;
  const unsigned passes = (bits + most - 1) / most;
  const unsigned digit = (bits + passes - 1) / passes;
  const std::size_t digits = std::size_t{1} << digit;
  LivePair* from = pairs;
  LivePair* to = spare;
  for (unsigned pass = few ? passes : 0; pass < 2 * passes; ++pass) {
    const bool by_second = pass < passes;
    const unsigned shift = (by_second ? pass : pass - passes) * digit;
    const auto digit_of = [&](const LivePair& p) {
      return ((by_second ? p.second : p.first) >> shift) & (digits - 1);
    };
    std::uint32_t counts[1 << 11];
    std::memset(counts, 0, digits * sizeof *counts);
    for (std::size_t i = 0; i < count; ++i) ++counts[digit_of(from[i])];
    std::exclusive_scan(counts, counts + digits, counts, 0u);
    for (std::size_t i = 0; i < count; ++i) to[counts[digit_of(from[i])]++] = from[i];
    std::swap(from, to);
  }
  if (from != pairs) std::memcpy(pairs, from, count * sizeof *pairs);
  if (few) sort_runs(pairs, count);
}

}  // namespace throng::live
