#include "tracking/merge_pairs.hpp"

#include <algorithm>
#include <cstring>

#include "base/prefetch.hpp"
#include "tracking/objects.hpp"
#include "tracking/radix_sort.hpp"

namespace throng::tracking {
namespace {

// Minimum pairs for a second task.
constexpr std::size_t part_pairs = 8192;
// Steps per prefetch.
constexpr std::size_t steps_at_once = 8;

void put(LivePair& to, std::uint64_t ids, std::uint32_t slot) noexcept {
  std::memcpy(&to, &ids, sizeof ids);
  to.slot = slot;
}

// Position in the merge of a part. A step consumes a new pair (it begins), an existing pair (it
// ends) or both. `steps` starts at part.begin + part.existing_begin, so steps - j is an index into
// `begun`, and steps - i one into `ended`.
struct MergeCursor {
  std::size_t i, j, steps;  // new pairs, existing pairs

  explicit MergeCursor(const MergePart& part) noexcept
      : i(part.begin), j(part.existing_begin), steps(part.begin + part.existing_begin) {}

  void prefetch_ahead(const MergeInput& in, const MergeOutput& out) const noexcept {
    static_assert(steps_at_once * sizeof(Pair) <= 64 && steps_at_once * sizeof(LivePair) <= 128);
    base::prefetch_l1(in.pairs + i + base::pairs_ahead);
    for (const std::size_t k : {std::size_t{0}, 64 / sizeof(LivePair)}) {
      base::prefetch_l1(in.existing + j + base::pairs_ahead + k);
      base::prefetch(out.pairs + i + base::pairs_ahead + k);
    }
  }
  // Branch-free: branches on the data would be mispredicted.
  void step(const MergeInput& in, const MergeOutput& out) noexcept {
    const std::uint64_t p = ids_at(in.pairs + i), l = ids_at(in.existing + j);
    const std::uint64_t a = key_of(p), b = key_of(l);
    const std::uint32_t slot = in.existing[j].slot;
    put(out.pairs[i], p, slot);
    put(out.begun[steps - j], p, static_cast<std::uint32_t>(i));
    put(out.ended[steps - i], l, slot);
    i += a <= b;
    j += b <= a;
    ++steps;
  }
  // Minimum number of steps left before one list ends.
  std::size_t min_steps(const MergePart& part) const noexcept {
    return std::min(part.end - i, part.existing_end - j);
  }
  // Copies the rest once one list is exhausted.
  void finish(const MergeInput& in, const MergeOutput& out, MergePart& part) noexcept {
    for (; i < part.end; ++i, ++steps) {
      put(out.pairs[i], ids_at(in.pairs + i), none);
      put(out.begun[steps - j], ids_at(in.pairs + i), static_cast<std::uint32_t>(i));
    }
    for (; j < part.existing_end; ++j, ++steps) out.ended[steps - i] = in.existing[j];
    part.begun = steps - j - part.begin;
    part.ended = steps - i - part.existing_begin;
  }
};

// Works on local copies, which stores to the output cannot alias.
template <class... Each>
void advance(const MergeInput& in, const MergeOutput& out, std::size_t count,
             Each&... each) noexcept {
  const auto run_on_copies = [&, in, out](auto... copies) {
    for (; count >= steps_at_once; count -= steps_at_once) {
      (copies.prefetch_ahead(in, out), ...);
      for (std::size_t k = 0; k < steps_at_once; ++k) (copies.step(in, out), ...);
    }
    for (; count != 0; --count) (copies.step(in, out), ...);
    ((each = copies), ...);
  };
  run_on_copies(each...);
}

}  // namespace

unsigned divide(const MergeInput& in, unsigned tasks, MergePart* parts) noexcept {
  const auto part_count = 2 * static_cast<unsigned>(std::min<std::size_t>(
                                  (in.count + in.existing_count) / part_pairs + 1,
                                  std::min(tasks == 1 ? 1 : 4 * tasks, max_merge_parts / 2)));
  const LivePair* const existing_end = in.existing + in.existing_count;
  for (unsigned p = 0; p < part_count; ++p) {
    MergePart& part = parts[p];
    part.begin = p == 0 ? 0 : parts[p - 1].end;
    part.existing_begin = p == 0 ? 0 : parts[p - 1].existing_end;
    part.end = p + 1 == part_count ? in.count : in.count / part_count * (p + 1);
    part.existing_end = in.existing_count;
    if (part.end < in.count) {
      const LivePair next{in.pairs[part.end].first, in.pairs[part.end].second, 0};
      part.existing_end = static_cast<std::size_t>(
          std::lower_bound(in.existing, existing_end, next, pair_less) - in.existing);
    }
  }
  return part_count;
}

// Interleaved, as the steps of one part depend on each other.
void merge(const MergeInput& in, const MergeOutput& out, MergePart& first,
           MergePart& second) noexcept {
  MergeCursor one(first), two(second);
  while (const std::size_t count = std::min(one.min_steps(first), two.min_steps(second)))
    advance(in, out, count, one, two);
  while (const std::size_t count = one.min_steps(first)) advance(in, out, count, one);
  while (const std::size_t count = two.min_steps(second)) advance(in, out, count, two);
  one.finish(in, out, first);
  two.finish(in, out, second);
}

}  // namespace throng::tracking
