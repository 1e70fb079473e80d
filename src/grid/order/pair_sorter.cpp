// Two methods: if each first has many seconds, one list per first; else buckets of several firsts,
// sorted one by one.
#include "grid/order/pair_sorter.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

#include "base/prefetch.hpp"
#include "base/profile.hpp"
#include "base/threads.hpp"
#include "grid/order/bucket.hpp"
#include "grid/order/pair_list_sorter.hpp"

namespace throng::grid {
namespace {

constexpr std::size_t bucket_pairs = 4096;  // target size
constexpr std::size_t one_bucket_pairs = 16384;
constexpr unsigned max_split_bits = 12;  // more would exceed the cache during the split
// Destination lines are prefetched this many pairs ahead. Without it stores wait for
// each other's lines and take twice as long.
constexpr std::size_t prefetch_distance = 12;
constexpr std::size_t seconds_per_line = 64 / sizeof(std::uint32_t);  // seconds per cache line
// Average pairs per first from which lists pay. Short lists share cache lines, so they pay only if
// one task has all of them, its cache holds a line per list, and one bucket would not do.
constexpr std::size_t long_list_pairs = 64, short_list_pairs = 4;
constexpr std::uint64_t max_lists_in_cache = 1u << 15;
constexpr std::size_t max_chunks = 256;  // of firsts, whose counters are summed
// Number of parts that tasks claim dynamically for counting and splitting: a few per task, so that
// a task that starts late does fewer; one per task if tasks are many.
constexpr unsigned part_count(unsigned tasks) noexcept {
  return tasks == 1 ? 1 : std::max(tasks, std::min(4 * tasks, 64u));
}

unsigned bits_of(std::uint64_t count) noexcept {
  return count < 2 ? 0 : static_cast<unsigned>(std::bit_width(count - 1));
}

// Moves each pair to the next place of its bucket, selected by the leading bits of `first`.
void scatter(const Pair* begin, const Pair* end, unsigned shift, std::uint64_t* next,
             Pair* to) noexcept {
  for (const Pair* p = begin; p != end; ++p) {
    Pair* const at = to + next[p->first >> shift]++;
    base::prefetch_l1(p + base::pairs_ahead);
    base::prefetch(at + prefetch_distance);
    *at = *p;
  }
}

}  // namespace

std::size_t PairSorter::bytes_for(std::size_t count, unsigned task_count) noexcept {
  const std::size_t histograms = std::max(
      (part_count(task_count) + std::size_t{1}) << max_split_bits, (count + count / 8) / 2 + 1);
  const std::size_t scratch = std::min(count, PairListSorter::scratch_pairs) * 2 * task_count + 1;
  return (histograms + scratch + scratch / 8) * sizeof(std::uint64_t);
}

void PairSorter::sort(const Kernels& kernels, const Executor& executor, unsigned task_count,
                      Pair* from, Pair* to, std::size_t count, std::uint64_t first_count,
                      std::uint64_t second_count) {
  THRONG_RANGE("order");
  if (count == 0) return;
  if (count < 16384) task_count = 1;
  const Job job{kernels, executor, task_count, from, to, count, first_count, second_count};
  const bool in_cache =
      task_count == 1 && count > one_bucket_pairs && first_count <= max_lists_in_cache;
  const std::size_t min_list_pairs = in_cache ? short_list_pairs : long_list_pairs;
  if (kernels.sort_lists && count <= PairListSorter::max_pairs &&
      first_count <= count / min_list_pairs)
    sort_as_lists(job);
  else
    sort_as_buckets(job);
}

// One pass scatters each pair to the list of its first.
void PairSorter::sort_as_lists(const Job& job) {
  const auto firsts = static_cast<std::size_t>(job.first_count);
  const auto parts = static_cast<unsigned>(std::min<std::size_t>(job.tasks, job.count / firsts));
  auto* const counters =
      reinterpret_cast<std::uint32_t*>(histograms_.ensure((parts * firsts + 1) / 2));
  Pair *const from = job.from, *const to = job.to;
  auto* const seconds = reinterpret_cast<std::uint32_t*>(to);
  const auto part = [&](std::size_t p) { return base::part_begin(job.count, parts, p); };
  base::parallel_for(job.executor, job.tasks, parts, [&](std::size_t p, unsigned) {
    std::uint32_t* const mine = counters + p * firsts;
    std::memset(mine, 0, firsts * sizeof *mine);
    // Two streams: neighbours often have the same first, and each increment would wait for the
    // other.
    const std::size_t begin = part(p), half = (part(p + 1) - begin) / 2;
    for (std::size_t i = begin; i < begin + half; ++i) {
      base::prefetch_l1(from + i + base::pairs_ahead);
      base::prefetch_l1(from + i + half + base::pairs_ahead);
      ++mine[from[i].first];
      ++mine[from[i + half].first];
    }
    for (std::size_t i = begin + 2 * half; i < part(p + 1); ++i) ++mine[from[i].first];
  });

  // Turns each counter into the destination of its part's seconds: the latter half of the
  // list's place in the output.
  const std::size_t chunks = job.tasks == 1 ? 1 : std::min<std::size_t>(4 * job.tasks, max_chunks);
  const auto chunk = [&](std::size_t c) { return base::part_begin(firsts, chunks, c); };
  std::uint32_t before[max_chunks + 1], longest[max_chunks];
  base::parallel_for(job.executor, job.tasks, chunks, [&](std::size_t c, unsigned) {
    std::uint32_t sum = 0, most = 0;
    for (std::size_t f = chunk(c); f < chunk(c + 1); ++f) {
      std::uint32_t list = 0;
      for (unsigned p = 0; p < parts; ++p) list += counters[p * firsts + f];
      sum += list;
      most = std::max(most, list);
    }
    before[c] = sum;
    longest[c] = most;
  });
  std::exclusive_scan(before, before + chunks, before, 0u);
  base::parallel_for(job.executor, job.tasks, chunks, [&](std::size_t c, unsigned) {
    std::uint32_t end = 2 * before[c];
    for (std::size_t f = chunk(c); f < chunk(c + 1); ++f) {
      for (unsigned p = 0; p < parts; ++p) end += counters[p * firsts + f];
      for (unsigned p = 0; p < parts; ++p) {
        std::uint32_t& at = counters[p * firsts + f];
        at = std::exchange(end, end + at);
      }
    }
  });
  base::parallel_for(job.executor, job.tasks, parts, [&](std::size_t p, unsigned) {
    std::uint32_t* const next = counters + p * firsts;
    for (const Pair *q = from + part(p), *const end = from + part(p + 1); q != end; ++q) {
      std::uint32_t* const at = seconds + next[q->first]++;
      base::prefetch_l1(q + base::pairs_ahead);
      base::prefetch(at + seconds_per_line);
      *at = q->second;
    }
  });

  const PairListSorter lists(seconds, to, job.count, counters + (parts - 1) * firsts, 0,
                             bits_of(job.second_count));
  const std::size_t scratch_size = lists.scratch_size(*std::max_element(longest, longest + chunks));
  std::uint64_t* const scratch = scratch_.ensure(scratch_size * job.tasks);
  // More lists at once give better groups of similar length, but each task should get some chunks.
  const std::size_t chunks_wanted = 1 + std::size_t{4} * (job.tasks - 1);
  const std::size_t step = std::clamp<std::size_t>(firsts / chunks_wanted / lists_per_sort, 1,
                                                   PairListSorter::max_lists / lists_per_sort) *
                           lists_per_sort;
  base::parallel_for(job.executor, job.tasks, (firsts + step - 1) / step,
                     [&](std::size_t s, unsigned t) {
                       lists.sort(job.kernels, s * step, std::min(firsts, (s + 1) * step),
                                  scratch + scratch_size * t, from);
                     });
}

// One pass splits the pairs into buckets by the leading bits of `first`; the buckets are sorted one
// by one.
void PairSorter::sort_as_buckets(const Job& job) {
  const std::size_t count = job.count;
  Pair *const from = job.from, *const to = job.to;
  const unsigned first_bits = bits_of(job.first_count), second_bits = bits_of(job.second_count);
  const unsigned all_bits = first_bits + second_bits;
  // Enough buckets; and if possible enough bits removed for the rest to fit 32.
  unsigned split_bits = count <= one_bucket_pairs ? 0 : bits_of(count / bucket_pairs + 1);
  if (all_bits > 32 && all_bits <= 32 + max_split_bits && count > 4096) {
    split_bits = std::max(split_bits, all_bits - 32);
  }
  split_bits = std::min({split_bits, first_bits, max_split_bits});
  const unsigned shift = first_bits - split_bits;
  const std::size_t buckets = std::size_t{1} << split_bits;
  if (buckets == 1) {
    std::memcpy(to, from, count * sizeof(Pair));
    const std::size_t scratch_size = Bucket::scratch_size(count);
    return sort_bucket(job.kernels, {to, count, first_bits, 0, second_bits},
                       scratch_.ensure(scratch_size), scratch_size);
  }
  const unsigned parts = part_count(job.tasks);
  std::uint64_t* histograms = histograms_.ensure((parts + std::size_t{1}) * buckets, true);
  const auto part = [&](std::size_t p) { return base::part_begin(count, parts, p); };
  base::parallel_for(job.executor, job.tasks, parts, [&](std::size_t p, unsigned) {
    std::uint64_t* mine = histograms + p * buckets;
    std::memset(mine, 0, buckets * sizeof *mine);
    for (std::size_t i = part(p), end = part(p + 1); i < end; ++i) {
      base::prefetch_l1(from + i + base::pairs_ahead);
      ++mine[from[i].first >> shift];
    }
  });
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
  base::parallel_for(job.executor, job.tasks, parts, [&](std::size_t p, unsigned) {
    scatter(from + part(p), from + part(p + 1), shift, histograms + p * buckets, to);
  });

  const std::size_t scratch_size = Bucket::scratch_size(
      static_cast<std::size_t>(std::min<std::uint64_t>(largest, PairListSorter::scratch_pairs)));
  std::uint64_t* scratch = scratch_.ensure(scratch_size * job.tasks + 1);
  base::parallel_for(job.executor, job.tasks, buckets, [&](std::size_t b, unsigned t) {
    const std::uint64_t begin = b == 0 ? 0 : ends[b - 1];
    const auto size = static_cast<std::size_t>(ends[b] - begin);
    const Bucket bucket{to + begin, size, shift,
                        static_cast<std::uint32_t>(std::uint64_t{b} << shift), second_bits};
    if (size <= PairListSorter::scratch_pairs)
      sort_bucket(job.kernels, bucket, scratch + scratch_size * t, scratch_size);
    else
      sort_bucket(job.kernels, bucket, reinterpret_cast<std::uint64_t*>(from + begin), size);
  });
}

}  // namespace throng::grid
