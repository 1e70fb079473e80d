// Three ways to sort a bucket in a core's L2 cache: as lists, if a first has many seconds; by the
// leading bits of the keys, which leaves short runs to sort; or, for any pairs, by LSD radix sort,
// in half the space if keys fit 32 bits.
#include "grid/order/bucket.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <utility>

#include "base/prefetch.hpp"
#include "grid/order/pair_list_sorter.hpp"

namespace throng::grid {
namespace {

constexpr unsigned most_digit_bits = 11;
constexpr unsigned most_passes = 6;         // for 64 bits
constexpr std::size_t min_list_pairs = 16;  // mean seconds per first from which lists are faster
// A run takes as many steps as it has keys. With twice this limit it is no faster.
constexpr std::uint32_t most_run_keys = 48;
constexpr unsigned most_run_bits = 13;
constexpr std::size_t few_pairs = 48;

// Key of a pair: the low bits of its first, then its second.
template <class Key>
auto key_maker(const Bucket& bucket) noexcept {
  const auto first_mask = static_cast<std::uint32_t>((std::uint64_t{1} << bucket.first_bits) - 1);
  return [first_mask, second_bits = bucket.second_bits](Pair p) {
    return static_cast<Key>(Key{p.first & first_mask} << second_bits | p.second);
  };
}
bool fits_32_bits(const Bucket& bucket) noexcept {
  return bucket.key_bits() <= 32 && bucket.second_bits < 32;
}

// Number of digits. A pass costs one move per key; a counter costs a fraction of one.
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

// a and b have space for one key per pair. If `a` is null, the keys alternate between b and the
// memory of the pairs.
template <class Key>
void radix_sort(const Bucket& bucket, Key* a, Key* b) {
  Pair* const pairs = bucket.pairs;
  const std::size_t count = bucket.count;
  const auto key_of = key_maker<Key>(bucket);
  const auto pair_of = [above = bucket.first_above, second_bits = bucket.second_bits](Key key) {
    return Pair{above | static_cast<std::uint32_t>(key >> second_bits),
                static_cast<std::uint32_t>(key & ((Key{1} << second_bits) - 1))};
  };
  const unsigned passes = digit_count(count, bucket.key_bits(), a == nullptr);
  const unsigned digit = (bucket.key_bits() + passes - 1) / passes;
  const std::size_t digits = std::size_t{1} << digit;
  const Key mask = static_cast<Key>(digits - 1);

  // Counts all digits in one pass: independent counters do not wait for each other.
  std::uint32_t counts[most_passes << most_digit_bits];
  std::memset(counts, 0, passes * digits * sizeof *counts);
  const auto count_keys = [&](auto pass_count) {
    for (std::size_t i = 0; i < count; ++i) {
      base::prefetch_l1(pairs + i + base::pairs_ahead);
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

// Adjacent pairs often have the same first, which makes each increment wait for the last one. So
// four positions are processed at once.
template <class F>
void each_pair(const Bucket& bucket, const F& f) {
  const Pair* const pairs = bucket.pairs;
  const std::size_t quarter = bucket.count / 4;
  for (std::size_t i = 0; i < quarter; ++i) {
    f(pairs[i]), f(pairs[i + quarter]), f(pairs[i + 2 * quarter]), f(pairs[i + 3 * quarter]);
  }
  for (std::size_t i = 4 * quarter; i < bucket.count; ++i) f(pairs[i]);
}

// Returns false without effect if digits cost less or there is too little space.
bool sort_as_lists(const Kernels& kernels, const Bucket& bucket, std::uint64_t* scratch,
                   std::size_t scratch_count) {
  const std::size_t firsts = std::size_t{1} << bucket.first_bits;
  if (!kernels.sort_lists || firsts > PairListSorter::max_lists ||
      bucket.count < min_list_pairs * firsts || bucket.count > PairListSorter::max_pairs)
    return false;
  if (scratch_count < 2 * bucket.count || digit_count(bucket.count, bucket.key_bits(), false) == 2)
    return false;
  std::uint32_t ends[PairListSorter::max_lists] = {};
  const auto first_mask = static_cast<std::uint32_t>(firsts - 1);
  each_pair(bucket, [&](Pair p) { ++ends[p.first & first_mask]; });
  std::uint32_t sum = 0;
  for (std::size_t f = 0; f < firsts; ++f) {  // middle of the list's space
    const std::uint32_t count = ends[f];
    ends[f] = sum + count;
    sum += 2 * count;
  }
  auto* const seconds = reinterpret_cast<std::uint32_t*>(scratch);
  each_pair(bucket, [&](Pair p) { seconds[ends[p.first & first_mask]++] = p.second; });
  PairListSorter(seconds, bucket.pairs, bucket.count, ends, bucket.first_above, bucket.second_bits)
      .sort(kernels, 0, firsts, scratch + bucket.count, nullptr);
  return true;
}

// One pass by as many leading bits as leave about one or two keys per digit. Returns false without
// effect if some digit has many keys.
bool sort_as_runs(const Kernels& kernels, const Bucket& bucket, std::uint64_t* scratch) {
  const Pair* const pairs = bucket.pairs;
  const std::size_t count = bucket.count;
  if (!kernels.sort_runs || count <= few_pairs || !fits_32_bits(bucket)) return false;
  static_assert(few_pairs >= KeyRuns::padding);  // `scratch` holds two keys per pair
  const unsigned bits = std::min(
      {static_cast<unsigned>(std::bit_width(count)) - 1, bucket.key_bits(), most_run_bits});
  const unsigned shift = bucket.key_bits() - bits;
  const std::size_t digits = std::size_t{1} << bits;
  if (count > most_run_keys * digits) return false;  // counts fit 32 bits, too
  const auto key_of = key_maker<std::uint32_t>(bucket);
  std::uint32_t at[std::size_t{1} << most_run_bits];
  std::memset(at, 0, digits * sizeof *at);
  for (std::size_t i = 0; i < count; ++i) {
    base::prefetch_l1(pairs + i + base::pairs_ahead);
    ++at[key_of(pairs[i]) >> shift];
  }
  std::uint32_t sum = 0, longest = 0;
  for (std::size_t digit = 0; digit < digits; ++digit) {
    longest = std::max(longest, at[digit]);
    sum += std::exchange(at[digit], sum);
  }
  if (longest > most_run_keys) return false;
  auto* const keys = reinterpret_cast<std::uint32_t*>(scratch);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t key = key_of(pairs[i]);
    keys[at[key >> shift]++] = key;
  }
  kernels.sort_runs({base::PaddedArray<std::uint32_t, KeyRuns::padding>::of(keys), count, longest,
                     bucket.first_above, bucket.second_bits},
                    bucket.pairs);
  return true;
}

}  // namespace

void sort_bucket(const Kernels& kernels, const Bucket& bucket, std::uint64_t* scratch,
                 std::size_t scratch_count) {
  if (sort_as_lists(kernels, bucket, scratch, scratch_count)) return;
  if (sort_as_runs(kernels, bucket, scratch)) return;
  radix_sort_bucket(bucket, scratch, scratch_count);
}

void radix_sort_bucket(const Bucket& bucket, std::uint64_t* scratch, std::size_t scratch_count) {
  const std::size_t count = bucket.count;
  if (count < 2 || bucket.key_bits() == 0) return;
  if (count <= few_pairs || count > 0xffffffffu) {
    std::sort(bucket.pairs, bucket.pairs + count);
    return;
  }
  auto* const narrow = reinterpret_cast<std::uint32_t*>(scratch);
  if (fits_32_bits(bucket))
    radix_sort<std::uint32_t>(bucket, narrow, narrow + count);
  else if (scratch_count >= 2 * count)
    radix_sort<std::uint64_t>(bucket, scratch, scratch + count);
  else
    radix_sort<std::uint64_t>(bucket, nullptr, scratch);
}

}  // namespace throng::grid
