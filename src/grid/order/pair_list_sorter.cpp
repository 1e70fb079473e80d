// Lists of similar length are sorted side by side; a long one by radix sort.
#include "grid/order/pair_list_sorter.hpp"

#include <algorithm>
#include <numeric>

#include "base/prefetch.hpp"
#include "grid/order/bucket.hpp"

namespace throng::grid {
namespace {

constexpr std::uint32_t max_rows = 4096;
constexpr std::uint32_t groups_ahead = 4;
constexpr std::uint32_t length_classes = max_rows / 8 + 2;

}  // namespace

PairListSorter::PairListSorter(const std::uint32_t* seconds, Pair* to, std::size_t count,
                               const std::uint32_t* ends, std::uint32_t first_above,
                               unsigned second_bits) noexcept
    : seconds_(seconds),
      to_(to),
      ends_(ends),
      first_above_(first_above),
      second_bits_(second_bits),
      // Scratch for all rows then never exceeds one 64-bit value per pair.
      max_rows_(static_cast<std::uint32_t>(std::min<std::size_t>(max_rows, count / 64 * 8))) {}

std::size_t PairListSorter::scratch_size(std::size_t longest) const noexcept {
  const std::size_t rows = std::min<std::size_t>((longest + 7) / 8 * 8, max_rows_);
  return std::max(rows * lists_per_sort / 2, std::min(longest, scratch_pairs));
}

// The length in rows of eight, rounded up; the last class is for long lists.
std::uint32_t PairListSorter::length_class(std::uint32_t count) const noexcept {
  return count <= max_rows_ ? (count + 7) / 8 : length_classes - 1;
}

void PairListSorter::sort(const Kernels& kernels, std::size_t begin, std::size_t end,
                          std::uint64_t* scratch, Pair* spare) const {
  const auto firsts = static_cast<std::uint32_t>(end - begin);
  std::uint32_t starts[max_lists + 1];
  std::uint32_t class_end[length_classes] = {};
  std::uint16_t ranked[max_lists];
  starts[0] = begin == 0 ? 0 : ends_[begin - 1] / 2;
  for (std::uint32_t f = 0; f < firsts; ++f) starts[f + 1] = ends_[begin + f] / 2;
  const auto count_of = [&](std::uint32_t f) { return starts[f + 1] - starts[f]; };
  for (std::uint32_t f = 0; f < firsts; ++f) ++class_end[length_class(count_of(f))];
  std::exclusive_scan(class_end, class_end + length_classes, class_end, 0u);
  for (std::uint32_t f = 0; f < firsts; ++f) {
    ranked[class_end[length_class(count_of(f))]++] = static_cast<std::uint16_t>(f);
  }
  // After the scatter, class_end[c] is where class c + 1 starts.
  const std::uint32_t long_begin = class_end[length_classes - 2];
  // The latter half of the list's destination.
  const auto seconds_of = [&](std::uint32_t f) { return seconds_ + 2 * starts[f] + count_of(f); };
  const auto first_of = [&](std::uint32_t f) {
    return first_above_ + static_cast<std::uint32_t>(begin) + f;
  };
  // Lists are scattered in memory: they are prefetched some groups ahead, and again while
  // the previous group is sorted.
  const auto prefetch_group = [&](std::uint32_t at) {
    for (std::uint32_t i = at; i < std::min(at + lists_per_sort, long_begin); ++i) {
      const std::uint32_t f = ranked[i];
      for (std::uint32_t k = 0; k < count_of(f); k += 8) base::prefetch_l2(to_ + starts[f] + k);
    }
  };
  PairList groups[2][lists_per_sort];
  const auto gather = [&](std::uint32_t at, PairList* group) {
    for (std::uint32_t i = 0; i < lists_per_sort; ++i) {
      group[i] = {};
      if (at + i >= long_begin) continue;
      const std::uint32_t f = ranked[at + i];
      group[i] = {seconds_of(f), to_ + starts[f], count_of(f), first_of(f)};
      for (std::uint32_t k = 0; k < group[i].count; k += 8) base::prefetch(group[i].to + k);
    }
  };
  for (std::uint32_t g = 1; g < groups_ahead; ++g)
    prefetch_group(class_end[0] + g * lists_per_sort);
  gather(class_end[0], groups[0]);
  for (std::uint32_t at = class_end[0], g = 0; at < long_begin; at += lists_per_sort, g ^= 1) {
    prefetch_group(at + groups_ahead * lists_per_sort);
    gather(at + lists_per_sort, groups[g ^ 1]);
    const std::uint32_t last = ranked[std::min(at + lists_per_sort, long_begin) - 1];
    kernels.sort_lists(groups[g], 8 * length_class(count_of(last)),
                       reinterpret_cast<std::uint32_t*>(scratch));
  }
  for (std::uint32_t at = long_begin; at < firsts; ++at) {
    const std::uint32_t f = ranked[at], count = count_of(f);
    Pair* const pairs = to_ + starts[f];
    const std::uint32_t* const seconds = seconds_of(f);
    for (std::uint32_t k = 0; k < count; ++k) pairs[k] = {first_of(f), seconds[k]};
    const Bucket bucket{pairs, count, 0, first_of(f), second_bits_};
    if (count <= scratch_pairs)
      radix_sort_bucket(bucket, scratch, count);
    else
      radix_sort_bucket(bucket, reinterpret_cast<std::uint64_t*>(spare + starts[f]), count);
  }
}

}  // namespace throng::grid
