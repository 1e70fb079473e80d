#include "live/merge.hpp"

#include <algorithm>
#include <cstring>

#include "cpu/prefetch.hpp"
#include "live/objects.hpp"
#include "live/sort.hpp"

namespace throng::live {
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
// ends) or both. `steps` starts at part.begin + part.live_begin, so steps - j is an index into
// `begun`, and steps - i one into `ended`.
struct Progress {
  std::size_t i, j, steps;  // new pairs, existing pairs

  explicit Progress(const MergePart& part) noexcept
      : i(part.begin), j(part.live_begin), steps(part.begin + part.live_begin) {}

  void ask(const MergeInput& in, const MergeOutput& out) const noexcept {
    static_assert(steps_at_once * sizeof(Pair) <= 64 && steps_at_once * sizeof(LivePair) <= 128);
    cpu::prefetch_to_stream(in.pairs + i + cpu::pairs_ahead);
    for (const std::size_t k : {std::size_t{0}, 64 / sizeof(LivePair)}) {
      cpu::prefetch_to_stream(in.live + j + cpu::pairs_ahead + k);
      cpu::prefetch(out.pairs + i + cpu::pairs_ahead + k);
    }
  }
  // Branch-free: branches on the data would be mispredicted.
  void step(const MergeInput& in, const MergeOutput& out) noexcept {
    const std::uint64_t p = ids_at(in.pairs + i), l = ids_at(in.live + j);
    const std::uint64_t a = key_of(p), b = key_of(l);
    const std::uint32_t slot = in.live[j].slot;
    put(out.pairs[i], p, slot);
    put(out.begun[steps - j], p, static_cast<std::uint32_t>(i));
    put(out.ended[steps - i], l, slot);
    i += a <= b;
    j += b <= a;
    ++steps;
  }
  // Minimum number of steps left before one list ends.
  std::size_t sure(const MergePart& part) const noexcept {
    return std::min(part.end - i, part.live_end - j);
  }
  // Copies the rest once one list is exhausted.
  void finish(const MergeInput& in, const MergeOutput& out, MergePart& part) noexcept {
    for (; i < part.end; ++i, ++steps) {
      put(out.pairs[i], ids_at(in.pairs + i), none);
      put(out.begun[steps - j], ids_at(in.pairs + i), static_cast<std::uint32_t>(i));
    }
    for (; j < part.live_end; ++j, ++steps) out.ended[steps - i] = in.live[j];
    part.begun = steps - j - part.begin;
    part.ended = steps - i - part.live_begin;
  }
};

// Works on local copies, which stores to the output cannot alias.
template <class... Each>
void go_on(const MergeInput& in, const MergeOutput& out, std::size_t count,
           Each&... each) noexcept {
  const auto in_copies = [&, in, out](auto... copies) {
    for (; count >= steps_at_once; count -= steps_at_once) {
      (copies.ask(in, out), ...);
      for (std::size_t k = 0; k < steps_at_once; ++k) (copies.step(in, out), ...);
    }
    for (; count != 0; --count) (copies.step(in, out), ...);
    ((each = copies), ...);
  };
  in_copies(each...);
}

}  // namespace

unsigned divide(const MergeInput& in, unsigned tasks, MergePart* parts) noexcept {
  const auto part_count = 2 * static_cast<unsigned>(std::min<std::size_t>(
                                  (in.count + in.live_count) / part_pairs + 1,
                                  std::min(tasks == 1 ? 1 : 4 * tasks, most_merge_parts / 2)));
  const LivePair* const live_end = in.live + in.live_count;
  for (unsigned p = 0; p < part_count; ++p) {
    MergePart& part = parts[p];
    part.begin = p == 0 ? 0 : parts[p - 1].end;
    part.live_begin = p == 0 ? 0 : parts[p - 1].live_end;
    part.end = p + 1 == part_count ? in.count : in.count / part_count * (p + 1);
    part.live_end = in.live_count;
    if (part.end < in.count) {
      const LivePair next{in.pairs[part.end].first, in.pairs[part.end].second, 0};
      part.live_end =
          static_cast<std::size_t>(std::lower_bound(in.live, live_end, next, before) - in.live);
    }
  }
  return part_count;
}

// Interleaved, as the steps of one part depend on each other.
void merge(const MergeInput& in, const MergeOutput& out, MergePart& first,
           MergePart& second) noexcept {
  Progress one(first), two(second);
  while (const std::size_t count = std::min(one.sure(first), two.sure(second)))
    go_on(in, out, count, one, two);
  while (const std::size_t count = one.sure(first)) go_on(in, out, count, one);
  while (const std::size_t count = two.sure(second)) go_on(in, out, count, two);
  one.finish(in, out, first);
  two.finish(in, out, second);
}

}  // namespace throng::live
