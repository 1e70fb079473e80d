// Sorts up to some millions of pairs with thread blocks that have shared memory. The range of keys
// (PairKeys) is cut into buckets of equal width, most with some thousand pairs. All blocks count
// their pairs per bucket and scatter them. Then one block per bucket scatters its pairs into finer
// bins and ranks each pair within its bin. A bin of many pairs, and a bucket of more than
// block_pairs, is cut into runs, which are sorted separately and then merged four at a time. So the
// cost is bounded by the merge passes for any distribution, and memory depends on the number of
// pairs only.
//
// All pairs are different. Each phase below is the work of one of `step` threads, which start at 0,
// 1, .. step-1. All threads of the block synchronize between phases; those of the grid where noted.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "device/atomic.hpp"
#include "device/packed_pairs.hpp"
#include "device/pair_keys.hpp"

namespace throng::device {

// Sizes for a GPU with two resident blocks per SM.
struct DeviceSortSizes {
  static constexpr std::uint32_t block_pairs = 8192;  // pairs per block at a time
  static constexpr std::uint32_t bins = 4096;         // bins per bucket; also the most buckets
  static constexpr std::uint32_t run = 64;  // pairs that are ranked by comparing all with all
  static constexpr std::uint32_t single_block_pairs = 4096;  // pairs that one block sorts alone
  // Average pairs per bucket. More buckets are better until each block has its own. A bucket of the
  // lowest first indices has twice the average, plus random variation.
  static constexpr std::uint32_t min_buckets = 128, min_per_bucket = 1024, max_per_bucket = 3712;
  static constexpr std::uint32_t max_buckets = 2048;
};

template <class Sizes>
struct PairSorter {
  // With more pairs, buckets would be too large, or too many for the counts in shared memory. Then
  // a radix sort is used: its passes, which cost about 9 us each even for small inputs, are
  // efficient by then.
  static constexpr std::uint32_t max_pairs = Sizes::max_buckets / 2 * Sizes::max_per_bucket;
  static constexpr std::uint32_t block_pairs = Sizes::block_pairs, bins = Sizes::bins;
  static constexpr std::uint32_t run_pairs = Sizes::run,
                                 single_block_pairs = Sizes::single_block_pairs;
  static_assert(Sizes::max_buckets <= bins && single_block_pairs <= block_pairs);
  static_assert(std::has_single_bit(bins) && std::has_single_bit(block_pairs));
  static_assert(std::has_single_bit(run_pairs));

  // The work of one block: a bucket, or of an oversized bucket the pairs from `first` on.
  struct Task {
    std::uint32_t begin, end, first;

    THRONG_HD bool large() const noexcept { return end - begin > block_pairs; }
    THRONG_HD std::uint32_t last() const noexcept {
      return end - first > block_pairs ? first + block_pairs : end;
    }
  };
  // Number of pairs and of tasks of either kind before a bucket.
  struct Place {
    std::uint32_t pairs, small, large;

    THRONG_HD friend Place operator+(const Place& a, const Place& b) noexcept {
      return {a.pairs + b.pairs, a.small + b.small, a.large + b.large};
    }
  };
  // How pairs are divided into buckets, and those of a bucket into bins.
  struct Shape {
    PairKeys keys;
    std::uint32_t buckets;
    int bits, bin_bits;  // width in bits of a bucket's keys, and of a bin's

    THRONG_HD std::uint64_t key(PackedPair word) const noexcept {
      return (word >> 32) * keys.seconds + static_cast<std::uint32_t>(word);
    }
    THRONG_HD std::uint32_t bucket(PackedPair word) const noexcept {
      return static_cast<std::uint32_t>(key(word) >> bits);
    }
    THRONG_HD std::uint32_t bin(PackedPair word) const noexcept {
      const std::uint64_t within = key(word) & ((std::uint64_t{1} << bits) - 1);
      return static_cast<std::uint32_t>(within >> bin_bits);
    }
  };

  Pair* pairs;  // overwritten: scratch for as many words
  Pair* out;    // may be the same memory
  const Report* report;
  std::uint64_t capacity;
  PairKeys keys;
  // See carve().
  PackedPair* words = nullptr;
  std::uint32_t* totals = nullptr;          // per bucket
  Task *small = nullptr, *large = nullptr;  // large: chunks of oversized buckets

  // Sets the pointers into `memory`; returns the bytes for `count` pairs.
  std::size_t carve(std::size_t count, void* memory) noexcept {
    auto* at = static_cast<char*>(memory);
    std::size_t bytes = 0;
    const auto take = [&](auto*& p, std::size_t n) {
      if (at) p = reinterpret_cast<std::remove_reference_t<decltype(p)>>(at + bytes);
      bytes += n * sizeof *p;
    };
    take(words, count);
    take(totals, Sizes::max_buckets);
    take(small, Sizes::max_buckets);
    take(large, 2 * (count / block_pairs));
    return bytes;
  }
  static std::size_t bytes(std::size_t count) noexcept {
    return PairSorter{}.carve(count, nullptr);
  }

  // 0 if there is nothing to do.
  THRONG_HD std::uint32_t found() const noexcept {
    return report->found <= capacity ? static_cast<std::uint32_t>(report->found) : 0;
  }
  THRONG_HD Shape shape(std::uint32_t found) const noexcept {
    Shape s{keys, 1, width_of(keys.none()), 0};
    if (found > single_block_pairs) {
      std::uint32_t each = found / Sizes::min_buckets;
      if (each < Sizes::min_per_bucket) each = Sizes::min_per_bucket;
      if (each > Sizes::max_per_bucket) each = Sizes::max_per_bucket;
      // Between found / each buckets and twice as many.
      s.bits = width_of((keys.none() / (found / each)) | 1) - 1;
      s.buckets = static_cast<std::uint32_t>((keys.none() - 1) >> s.bits) + 1;
    }
    const int more = s.bits - (width_of(bins) - 1);
    s.bin_bits = more > 0 ? more : 0;
    return s;
  }

  // ---- the grid: into buckets ------------------------------------------------------------------

  // `counts`: the block's own, zeroed.
  THRONG_HD void count(const Shape& s, std::uint32_t found, std::uint32_t begin, std::uint32_t step,
                       std::uint32_t* counts) const noexcept {
    each_word(
        pairs, begin, found, step,
        [&](PackedPair word) { return fetch_add(counts + s.bucket(word), 1u); },
        [](PackedPair, std::uint32_t) {});
  }
  // Replaces a block's count by the offset of its pairs within the bucket. The grid synchronizes
  // before this, because the totals are zeroed, and after it.
  THRONG_HD void reserve(std::uint32_t bucket, std::uint32_t* counts) const noexcept {
    if (counts[bucket] != 0) counts[bucket] = fetch_add(totals + bucket, counts[bucket]);
  }
  // What a bucket adds to the place of the next.
  THRONG_HD static Place size(std::uint32_t total) noexcept {
    const std::uint32_t chunks = (total + block_pairs - 1) / block_pairs;
    return {total, chunks == 1, chunks > 1 ? chunks : 0};
  }
  // One thread per bucket.
  THRONG_HD void add_tasks(std::uint32_t total, const Place& at) const noexcept {
    const Task task{at.pairs, at.pairs + total, at.pairs};
    const Place own = size(total);
    if (own.small) small[at.small] = task;
    for (std::uint32_t k = 0; k < own.large; ++k)
      large[at.large + k] = {task.begin, task.end, task.begin + k * block_pairs};
  }
  // As count(); `next`: where the block's next pair of each bucket goes. The grid synchronizes
  // after this.
  THRONG_HD void scatter(const Shape& s, std::uint32_t found, std::uint32_t begin,
                         std::uint32_t step, std::uint32_t* next) const noexcept {
    each_word(
        pairs, begin, found, step,
        [&](PackedPair word) { return fetch_add(next + s.bucket(word), 1u); },
        [&](PackedPair word, std::uint32_t to) { words[to] = word; });
  }

  // ---- a block: a task's pairs -----------------------------------------------------------------

  THRONG_HD void count_bins(const Shape& s, const Task& task, std::uint32_t begin,
                            std::uint32_t step, std::uint32_t* counts) const noexcept {
    each_word(
        words + task.first, begin, task.last() - task.first, step,
        [&](PackedPair word) { return fetch_add(counts + s.bin(word), 1u); },
        [](PackedPair, std::uint32_t) {});
  }
  // Scatters into the block's memory by bins. `next`: in, where each bin begins; out, where it
  // ends.
  THRONG_HD void place(const Shape& s, const Task& task, std::uint32_t begin, std::uint32_t step,
                       std::uint32_t* next, PackedPair* placed) const noexcept {
    each_word(
        words + task.first, begin, task.last() - task.first, step,
        [&](PackedPair word) { return fetch_add(next + s.bin(word), 1u); },
        [&](PackedPair word, std::uint32_t to) { placed[to] = word; });
  }
  // Returns the place of the i-th pair once all runs are sorted. A bin of at most run_pairs is one
  // run.
  THRONG_HD static std::uint32_t ranked(const Shape& s, const PackedPair* placed,
                                        const std::uint32_t* ends, std::uint32_t i) noexcept {
    const PackedPair word = placed[i];
    const std::uint32_t bin = s.bin(word), begin = bin ? ends[bin - 1] : 0, end = ends[bin];
    const std::uint32_t run = begin + (i - begin) / run_pairs * run_pairs;
    const std::uint32_t run_end = end - run > run_pairs ? run + run_pairs : end;
    std::uint32_t less = 0;
    for (std::uint32_t k = run; k < run_end; ++k) less += placed[k] < word;
    return run + less;
  }
  // Returns its place once each four runs of `width` in a bin are merged into one.
  THRONG_HD static std::uint32_t merged(const Shape& s, const PackedPair* from,
                                        const std::uint32_t* ends, std::uint32_t i,
                                        std::uint32_t width) noexcept {
    const std::uint32_t bin = s.bin(from[i]);
    return device::merged(from, bin ? ends[bin - 1] : 0, ends[bin], i, width);
  }
  // Writes a pair to `out`, or, if its bucket is oversized, to the source of the merge passes.
  THRONG_HD void deliver(const Task& task, std::uint32_t i, PackedPair word) const noexcept {
    if (task.large())
      spare()[task.first + i] = word;
    else
      store(out + task.first + i, word);
  }

  // ---- the grid: buckets that are too large ----------------------------------------------------

  // Number of merge passes if the largest bucket has `most` pairs. Even, so that the last pass
  // reads `words`, because `out` may be `pairs`.
  THRONG_HD static std::uint32_t passes(std::uint32_t most) noexcept {
    std::uint32_t n = 0;
    for (std::uint64_t width = block_pairs; width < most; width *= 4) ++n;
    return n + n % 2;
  }
  // Merges the i-th of all pairs, of a large task's bucket. The grid synchronizes after each pass.
  THRONG_HD void merge(const Task& task, std::uint32_t i, std::uint32_t pass,
                       std::uint32_t all) const noexcept {
    const PackedPair* from = pass % 2 ? words : spare();
    const std::uint32_t to = device::merged(from, task.begin, task.end, i, block_pairs << 2 * pass);
    if (pass + 1 == all)
      store(out + to, from[i]);
    else
      (pass % 2 ? spare() : words)[to] = from[i];
  }

 private:
  THRONG_HD PackedPair* spare() const noexcept { return reinterpret_cast<PackedPair*>(pairs); }
  THRONG_HD static int width_of(std::uint64_t value) noexcept {
#if defined(__CUDA_ARCH__)
    return 64 - __clzll(static_cast<long long>(value));
#else
    return static_cast<int>(std::bit_width(value));
#endif
  }
};

}  // namespace throng::device
