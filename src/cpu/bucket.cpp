// Two ways to sort a bucket in a core's second level of cache: its keys from their last digit up,
// in half the room where they fit 32 bits; or, where a first has many seconds, those of sixteen
// firsts at once.
#include "cpu/bucket.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <utility>

namespace throng::cpu {
namespace {

constexpr unsigned most_digit_bits = 11;
constexpr unsigned most_passes = 6;  // of 64 bits
// Of a bucket that is sorted in columns: its firsts and its pairs at most, and of each first so
// many seconds at least.
constexpr std::size_t most_firsts = 1024, most_pairs = 1u << 18, least_seconds = 8;

// What a pair costs, in ns, measured on the machine of docs/benchmarks.md; only the ratios matter.
// By digits, once and a pass; in columns, once, a place in a column, and each doubling of eight
// rows.
constexpr double digits_ns = 0.7, pass_ns = 1.2;
constexpr double columns_ns = 2, place_ns = 0.15, doubling_ns = 0.1;

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

// a and b have room for as many keys as there are pairs. `a` may be null, then the keys go to and
// fro between b and the pairs' own room.
template <class Key>
void sort_by_digits(const Bucket& bucket, Key* a, Key* b) {
  Pair* const pairs = bucket.pairs;
  const std::size_t count = bucket.count;
  const auto first_mask = static_cast<std::uint32_t>((std::uint64_t{1} << bucket.first_bits) - 1);
  const auto key_of = [first_mask, second_bits = bucket.second_bits](Pair p) {
    return static_cast<Key>(Key{p.first & first_mask} << second_bits | p.second);
  };
  const auto pair_of = [above = bucket.first_above, second_bits = bucket.second_bits](Key key) {
    return Pair{above | static_cast<std::uint32_t>(key >> second_bits),
                static_cast<std::uint32_t>(key & ((Key{1} << second_bits) - 1))};
  };
  const unsigned passes = digit_count(count, bucket.key_bits(), a == nullptr);
  const unsigned digit = (bucket.key_bits() + passes - 1) / passes;
  const std::size_t digits = std::size_t{1} << digit;
  const Key mask = static_cast<Key>(digits - 1);

  // All counts in one go: of several counters at once none waits for itself.
  std::uint32_t counts[most_passes << most_digit_bits];
  std::memset(counts, 0, passes * digits * sizeof *counts);
  const auto count_keys = [&](auto pass_count) {
    for (std::size_t i = 0; i < count; ++i) {
      Key key = key_of(pairs[i]);
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
    std::exclusive_scan(at, at + digits, at, 0u);
    const unsigned shift = p * digit;
    const auto move_keys = [&](auto source, auto target) {
      for (std::size_t i = 0; i < count; ++i) {
        const Key key = source(i);
        target(at[(key >> shift) & mask]++, key);
      }
    };
    const auto keys = [from](std::size_t i) { return from[i]; };
    const auto to_keys = [to](std::uint32_t i, Key key) { to[i] = key; };
    const auto to_pairs = [&](std::uint32_t i, Key key) { pairs[i] = pair_of(key); };
    if (!from) {
      move_keys([&](std::size_t i) { return key_of(pairs[i]); }, to_keys);
    } else if (p + 1 < passes) {
      move_keys(keys, to_keys);
    } else {
      move_keys(keys, to_pairs);
    }
    from = to;
    std::swap(to, spare);
  }
}

// Neighbours often have the same first, where each waits for the one before it to be counted: so
// pairs are gone through from four beginnings at once.
template <class F>
void each_pair(const Bucket& bucket, const F& f) {
  const Pair* const pairs = bucket.pairs;
  const std::size_t quarter = bucket.count / 4;
  for (std::size_t i = 0; i < quarter; ++i) {
    f(pairs[i]), f(pairs[i + quarter]), f(pairs[i + 2 * quarter]), f(pairs[i + 3 * quarter]);
  }
  for (std::size_t i = 4 * quarter; i < bucket.count; ++i) f(pairs[i]);
}

// A first's seconds go down a column, beside those of firsts that have about as many. False, and
// nothing is done, where digits would cost less, or there is too little room.
bool sort_by_columns(const Kernels& kernels, const Bucket& bucket, std::uint32_t* room,
                     std::size_t places) {
  constexpr std::uint32_t width = sorted_columns;
  const std::size_t firsts = std::size_t{1} << bucket.first_bits;
  if (!kernels.sort_columns || firsts > most_firsts) return false;
  if (bucket.count > most_pairs || bucket.count < least_seconds * firsts) return false;
  const unsigned passes = digit_count(bucket.count, bucket.key_bits(), false);
  if (passes == 2) return false;
  const double most_ns =
      static_cast<double>(bucket.count) * (digits_ns + pass_ns * passes - columns_ns);
  const auto first_mask = static_cast<std::uint32_t>(firsts - 1);
  std::uint32_t counts[most_firsts] = {};
  each_pair(bucket, [&](Pair p) { ++counts[p.first & first_mask]; });

  // The firsts by how many eights of seconds they have.
  constexpr std::uint32_t classes = 256;
  const auto class_of = [](std::uint32_t n) { return std::min((n + 7) / 8, classes - 1); };
  std::uint32_t of_class[classes] = {}, begin[most_firsts];
  std::uint16_t ranked[most_firsts];
  for (std::size_t f = 0; f < firsts; ++f) ++of_class[class_of(counts[f])];
  std::exclusive_scan(of_class, of_class + classes, of_class, 0u);
  for (std::size_t f = 0; f < firsts; ++f) {
    ranked[of_class[class_of(counts[f])]++] = static_cast<std::uint16_t>(f);
  }
  std::exclusive_scan(counts, counts + firsts, begin, 0u);

  struct Group {
    std::size_t begin, end;  // of its firsts, by rank
    std::uint32_t rows;
  };
  const auto each_group = [&](const auto& f) {
    for (std::size_t at = 0; at < firsts; at += width) {
      Group group{at, std::min<std::size_t>(at + width, firsts), 0};
      for (std::size_t c = group.begin; c < group.end; ++c) {
        group.rows = std::max(group.rows, (counts[ranked[c]] + 7) / 8 * 8);
      }
      if (group.rows != 0) f(group);
    }
  };
  std::uint32_t to[most_firsts];
  std::size_t taken = 0;
  double ns = 0;
  each_group([&](const Group& group) {
    for (std::size_t c = group.begin; c < group.end; ++c) {
      to[ranked[c]] = static_cast<std::uint32_t>(taken + c - group.begin);
    }
    const std::size_t own = std::size_t{group.rows} * width;
    taken += own;
    ns += static_cast<double>(own) * (place_ns + doubling_ns * std::bit_width(group.rows / 9));
  });
  if (taken > places || ns > most_ns) return false;

  std::memset(room, 0xff, taken * sizeof *room);  // above any id
  each_pair(bucket, [&to, room, first_mask](Pair p) {
    std::uint32_t& at = to[p.first & first_mask];
    room[at] = p.second;
    at += width;
  });
  each_group([&](const Group& group) {
    kernels.sort_columns(room, group.rows);
    for (std::size_t c = group.begin; c < group.end; ++c) {
      const std::uint32_t f = ranked[c], n = counts[f], first = bucket.first_above | f;
      const std::uint32_t* const column = room + (c - group.begin);
      Pair* const out = bucket.pairs + begin[f];
      for (std::uint32_t r = 0; r < n; ++r) out[r] = {first, column[r * width]};
    }
    room += std::size_t{group.rows} * width;
  });
  return true;
}

}  // namespace

void sort_bucket(const Kernels& kernels, const Bucket& bucket, std::uint64_t* room,
                 std::size_t room_count) {
  const std::size_t count = bucket.count;
  if (count < 2 || bucket.key_bits() == 0) return;
  if (count <= 48 || count > 0xffffffffu) {
    std::sort(bucket.pairs, bucket.pairs + count);
    return;
  }
  auto* const narrow = reinterpret_cast<std::uint32_t*>(room);
  if (sort_by_columns(kernels, bucket, narrow, 2 * room_count)) return;
  if (bucket.key_bits() <= 32 && bucket.second_bits < 32)
    sort_by_digits<std::uint32_t>(bucket, narrow, narrow + count);
  else if (room_count >= 2 * count)
    sort_by_digits<std::uint64_t>(bucket, room, room + count);
  else
    sort_by_digits<std::uint64_t>(bucket, nullptr, room);
}

}  // namespace throng::cpu
