// One pass by the leading bits of `first` splits the pairs into buckets; the rest of a bucket's
// keys is sorted from its last digit up, in a core's second level of cache, and in half the room
// where it fits 32 bits.
#include "cpu/order.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <type_traits>
#include <utility>

#include "core/profile.hpp"
#include "cpu/prefetch.hpp"
#include "cpu/threads.hpp"

namespace throng::cpu {
namespace {

constexpr std::size_t bucket_pairs = 4096;    // aimed at
constexpr std::size_t scratch_pairs = 65536;  // larger buckets are sorted out of the cache
constexpr unsigned most_split_bits = 12;      // beyond, the split itself runs out of cache
// A line that the split writes is asked for so many pairs ahead: a core's stores wait for one
// another's lines, and took twice as long.
constexpr std::size_t ahead = 16;
// Parts of the pairs that tasks count and split by turns, so that whoever starts late does fewer: a
// few a task, unless tasks are many.
constexpr unsigned part_count(unsigned tasks) noexcept {
  return tasks == 1 ? 1 : std::max(tasks, std::min(4 * tasks, 64u));
}
constexpr unsigned most_digit_bits = 11;
constexpr unsigned most_passes = 6;  // of 64 bits

unsigned bits_of(std::uint64_t count) noexcept {
  return count < 2 ? 0 : static_cast<unsigned>(std::bit_width(count - 1));
}

// A pair's key below the bits that all of its bucket share.
struct KeyLayout {
  unsigned second_bits;
  std::uint32_t first_mask;   // the bits of first that are in the key
  std::uint32_t first_above;  // those that are not: the bucket's
  template <class Key>
  Key key(Pair p) const noexcept {
    return static_cast<Key>(Key{p.first & first_mask} << second_bits | p.second);
  }
  template <class Key>
  Pair pair(Key key) const noexcept {
    return {first_above | static_cast<std::uint32_t>(key >> second_bits),
            static_cast<std::uint32_t>(key & ((Key{1} << second_bits) - 1))};
  }
};

// How many digits: passes cost what moving a key does, counters what a few do.
unsigned digit_count(std::size_t count, unsigned bits, bool even) noexcept {
  unsigned best = 0;
  double least = 0;
  for (unsigned passes = 2; passes <= most_passes; ++passes) {
    const unsigned digit = (bits + passes - 1) / passes;
    if (digit > most_digit_bits || (even && passes % 2 != 0)) continue;
    const double cost =
        passes * (static_cast<double>(count) + 0.5 * static_cast<double>(1u << digit));
    if (best == 0 || cost < least) {
      best = passes;
      least = cost;
    }
  }
  return best;
}

// Sorts `pairs` in place; a and b have room for as many keys. `a` may be null, then the keys go to
// and fro between b and the pairs' own room.
template <class Key>
void sort_bucket(Pair* pairs, std::size_t count, KeyLayout layout, unsigned bits, Key* a, Key* b) {
  if (count < 2 || bits == 0) return;
  if (count <= 48 || count > 0xffffffffu) {
    std::sort(pairs, pairs + count);
    return;
  }
  const unsigned passes = digit_count(count, bits, a == nullptr);
  const unsigned digit = (bits + passes - 1) / passes;
  const std::size_t digits = std::size_t{1} << digit;
  const Key mask = static_cast<Key>(digits - 1);

  // All counts in one go: of several counters at once none waits for itself.
  std::uint32_t counts[most_passes << most_digit_bits];
  std::memset(counts, 0, passes * digits * sizeof *counts);
  const auto count_keys = [&](auto pass_count) {
    for (std::size_t i = 0; i < count; ++i) {
      Key key = layout.key<Key>(pairs[i]);
      if (a) a[i] = key;
      for (unsigned p = 0; p < pass_count; ++p, key = static_cast<Key>(key >> digit)) {
        ++counts[p * digits + (key & mask)];
      }
    }
  };
  if (passes == 2)
    count_keys(std::integral_constant<unsigned, 2>());
  else if (passes == 3)
    count_keys(std::integral_constant<unsigned, 3>());
  else
    count_keys(passes);

  const Key* from = a;  // null: the keys are still pairs
  Key* to = b;
  Key* spare = a ? a : reinterpret_cast<Key*>(pairs);
  for (unsigned p = 0; p < passes; ++p) {
    std::uint32_t* at = counts + p * digits;
    std::uint32_t sum = 0;
    for (std::size_t d = 0; d < digits; ++d) {
      const std::uint32_t n = at[d];
      at[d] = sum;
      sum += n;
    }
    const unsigned shift = p * digit;
    const auto move_keys = [&](auto source, auto target) {
      for (std::size_t i = 0; i < count; ++i) {
        const Key key = source(i);
        target(at[(key >> shift) & mask]++, key);
      }
    };
    const auto keys = [from](std::size_t i) { return from[i]; };
    const auto to_keys = [to](std::uint32_t i, Key key) { to[i] = key; };
    const auto to_pairs = [&](std::uint32_t i, Key key) { pairs[i] = layout.pair(key); };
    if (!from) {
      move_keys([&](std::size_t i) { return layout.key<Key>(pairs[i]); }, to_keys);
    } else if (p + 1 < passes) {
      move_keys(keys, to_keys);
    } else {
      move_keys(keys, to_pairs);
    }
    from = to;
    std::swap(to, spare);
  }
}

}  // namespace

std::size_t PairSorter::bytes_for(std::size_t count, unsigned task_count) noexcept {
  const std::size_t histograms = (part_count(task_count) + std::size_t{1}) << most_split_bits;
  const std::size_t scratch = std::min(count, scratch_pairs) * 2 * task_count + 1;
  return (histograms + scratch + scratch / 8) * sizeof(std::uint64_t);
}

void PairSorter::sort(const Executor& executor, unsigned task_count, Pair* from, Pair* to,
                      std::size_t count, std::uint64_t first_count, std::uint64_t second_count) {
  THRONG_RANGE("order");
  const unsigned first_bits = bits_of(first_count), second_bits = bits_of(second_count);
  const unsigned all_bits = first_bits + second_bits;
  // Enough buckets, and enough bits taken off for the rest to fit 32 where that can be.
  unsigned split_bits = bits_of(count / bucket_pairs + 1);
  if (all_bits > 32 && all_bits <= 32 + most_split_bits && count > 4096) {
    split_bits = std::max(split_bits, all_bits - 32);
  }
  split_bits = std::min({split_bits, first_bits, most_split_bits});
  const unsigned shift = first_bits - split_bits;
  const std::size_t buckets = std::size_t{1} << split_bits;
  if (count < 16384) task_count = 1;

  const unsigned parts = part_count(task_count);
  std::uint64_t* histograms = histograms_.room((parts + std::size_t{1}) * buckets, true);
  const auto part = [&](unsigned p) {
    return count / parts * p + std::min<std::size_t>(p, count % parts);
  };
  std::atomic<unsigned> to_count{0}, to_split{0};
  auto count_task = [&](unsigned) {
    for (unsigned p; (p = to_count.fetch_add(1, std::memory_order_relaxed)) < parts;) {
      std::uint64_t* mine = histograms + p * buckets;
      std::memset(mine, 0, buckets * sizeof *mine);
      for (std::size_t i = part(p), end = part(p + 1); i < end; ++i) ++mine[from[i].first >> shift];
    }
  };
  run_tasks(executor, task_count, count_task);
  std::uint64_t sum = 0;
  std::uint64_t largest = 0;
  std::uint64_t* ends = histograms + parts * buckets;
  for (std::size_t b = 0; b < buckets; ++b) {
    const std::uint64_t begin = sum;
    for (unsigned p = 0; p < parts; ++p) {
      const std::uint64_t n = histograms[p * buckets + b];
      histograms[p * buckets + b] = sum;
      sum += n;
    }
    ends[b] = sum;
    largest = std::max(largest, sum - begin);
  }
  auto split_task = [&](unsigned) {
    for (unsigned p; (p = to_split.fetch_add(1, std::memory_order_relaxed)) < parts;) {
      std::uint64_t* mine = histograms + p * buckets;
      for (std::size_t i = part(p), end = part(p + 1); i < end; ++i) {
        Pair* const at = to + mine[from[i].first >> shift]++;
        prefetch(at + ahead);
        *at = from[i];
      }
    }
  };
  run_tasks(executor, task_count, split_task);

  const unsigned bits = shift + second_bits;
  const bool narrow = bits <= 32 && second_bits < 32;
  const std::size_t room =
      static_cast<std::size_t>(std::min<std::uint64_t>(largest, scratch_pairs)) * (narrow ? 1 : 2);
  std::uint64_t* scratch = scratch_.room(room * task_count + 1);
  std::atomic<std::size_t> next{0};
  auto sort_task = [&](unsigned t) {
    for (std::size_t b; (b = next.fetch_add(1, std::memory_order_relaxed)) < buckets;) {
      const std::uint64_t begin = b == 0 ? 0 : ends[b - 1];
      const auto size = static_cast<std::size_t>(ends[b] - begin);
      const KeyLayout layout{second_bits,
                             static_cast<std::uint32_t>((std::uint64_t{1} << shift) - 1),
                             static_cast<std::uint32_t>(std::uint64_t{b} << shift)};
      std::uint64_t* spare = size <= scratch_pairs ? scratch + room * t
                                                   : reinterpret_cast<std::uint64_t*>(from + begin);
      if (narrow) {
        auto* a = reinterpret_cast<std::uint32_t*>(spare);
        sort_bucket<std::uint32_t>(to + begin, size, layout, bits, a, a + size);
      } else if (size <= scratch_pairs) {
        sort_bucket<std::uint64_t>(to + begin, size, layout, bits, spare, spare + size);
      } else {
        sort_bucket<std::uint64_t>(to + begin, size, layout, bits, nullptr, spare);
      }
    }
  };
  run_tasks(executor, task_count, sort_task);
}

}  // namespace throng::cpu
