// One pass by the leading bits of `first` splits the pairs into buckets, which are sorted one by
// one.
#include "cpu/order.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/profile.hpp"
#include "cpu/bucket.hpp"
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

unsigned bits_of(std::uint64_t count) noexcept {
  return count < 2 ? 0 : static_cast<unsigned>(std::bit_width(count - 1));
}

}  // namespace

std::size_t PairSorter::bytes_for(std::size_t count, unsigned task_count) noexcept {
  const std::size_t histograms = (part_count(task_count) + std::size_t{1}) << most_split_bits;
  const std::size_t scratch = std::min(count, scratch_pairs) * 2 * task_count + 1;
  return (histograms + scratch + scratch / 8) * sizeof(std::uint64_t);
}

void PairSorter::sort(const Kernels& kernels, const Executor& executor, unsigned task_count,
                      Pair* from, Pair* to, std::size_t count, std::uint64_t first_count,
                      std::uint64_t second_count) {
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
  const auto part = [&](std::size_t p) { return count / parts * p + std::min(p, count % parts); };
  run_by_turns(executor, task_count, parts, [&](std::size_t p, unsigned) {
    std::uint64_t* mine = histograms + p * buckets;
    std::memset(mine, 0, buckets * sizeof *mine);
    for (std::size_t i = part(p), end = part(p + 1); i < end; ++i) ++mine[from[i].first >> shift];
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
  run_by_turns(executor, task_count, parts, [&](std::size_t p, unsigned) {
    std::uint64_t* mine = histograms + p * buckets;
    for (std::size_t i = part(p), end = part(p + 1); i < end; ++i) {
      Pair* const at = to + mine[from[i].first >> shift]++;
      prefetch(at + ahead);
      *at = from[i];
    }
  });

  const std::size_t room =
      Bucket::room_for(static_cast<std::size_t>(std::min<std::uint64_t>(largest, scratch_pairs)),
                       shift + second_bits);
  std::uint64_t* scratch = scratch_.room(room * task_count + 1);
  run_by_turns(executor, task_count, buckets, [&](std::size_t b, unsigned t) {
    const std::uint64_t begin = b == 0 ? 0 : ends[b - 1];
    const auto size = static_cast<std::size_t>(ends[b] - begin);
    const Bucket bucket{to + begin, size, shift,
                        static_cast<std::uint32_t>(std::uint64_t{b} << shift), second_bits};
    if (size <= scratch_pairs)
      sort_bucket(kernels, bucket, scratch + room * t, room);
    else
      sort_bucket(kernels, bucket, reinterpret_cast<std::uint64_t*>(from + begin), size);
  });
}

}  // namespace throng::cpu
