#include "live/sort.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

namespace throng::live {

void sort_pairs(LivePair* pairs, LivePair* spare, std::size_t count, std::size_t limit) noexcept {
  if (count < 48) {
    std::sort(pairs, pairs + count,
              [](const LivePair& a, const LivePair& b) { return key_of(a) < key_of(b); });
    return;
  }
  // From the last digit up. Small digits where there are few pairs to share the counters' cost.
  const unsigned bits = std::max(1u, static_cast<unsigned>(std::bit_width(limit)));
  const unsigned most = count < 4096 ? 7 : 11;
  const unsigned passes = (bits + most - 1) / most;
  const unsigned digit = (bits + passes - 1) / passes;
  const std::size_t digits = std::size_t{1} << digit;
  LivePair* from = pairs;
  LivePair* to = spare;
  for (unsigned pass = 0; pass < 2 * passes; ++pass) {
    const bool by_second = pass < passes;
    const unsigned shift = (by_second ? pass : pass - passes) * digit;
    const auto digit_of = [&](const LivePair& p) {
      return ((by_second ? p.second : p.first) >> shift) & (digits - 1);
    };
    std::size_t counts[1 << 11];
    std::memset(counts, 0, digits * sizeof *counts);
    for (std::size_t i = 0; i < count; ++i) ++counts[digit_of(from[i])];
    std::exclusive_scan(counts, counts + digits, counts, std::size_t{0});
    for (std::size_t i = 0; i < count; ++i) to[counts[digit_of(from[i])]++] = from[i];
    std::swap(from, to);
  }
  // An even number of passes: they lie where they were.
}

}  // namespace throng::live
