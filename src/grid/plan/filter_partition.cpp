#include "grid/plan/filter_partition.hpp"

#include <algorithm>

#include "grid/plan/estimate_pair_count.hpp"
#include "grid/plan/make_plan.hpp"
#include "grid/steps.hpp"

namespace throng::grid {
namespace {

std::int32_t world_of(const Boxes& boxes, std::uint32_t i, std::int32_t absent) noexcept {
  return boxes.filters.world ? boxes.filters.world[i] : absent;
}
bool static_of(const Boxes& boxes, std::uint32_t i) noexcept {
  return boxes.filters.is_static && boxes.filters.is_static[i] != 0;
}

}  // namespace

// Sorts ids by (static, world + 1, id): by counting if worlds are numbered densely, else by
// comparison.
void FilterPartition::sort(const Boxes& boxes, bool is_second, Sorted& out, BinReport& report) {
  static_assert(max_box_count + 1 <= 0xffffffffu, "n + 1 fits 32 bits");
  const auto n = static_cast<std::uint32_t>(boxes.size());
  out.boxes = &boxes;
  std::int32_t most = -1;
  for (std::uint32_t i = 0; i < n; ++i) most = std::max(most, world_of(boxes, i, -1));
  const std::uint64_t worlds = std::uint64_t(std::int64_t{most} + 2);
  std::uint32_t* ids = out.ids.ensure(n + 1);
  const auto slot_of = [&](std::uint32_t i) {
    return (static_of(boxes, i) ? worlds : 0) +
           std::uint64_t(std::int64_t{world_of(boxes, i, -1)} + 1);
  };
  const auto world_of_slot = [&](std::uint64_t slot) {
    return static_cast<std::int32_t>(static_cast<std::int64_t>(slot % worlds) - 1);
  };
  std::uint32_t run_count = 0, active = 0;
  for (auto& group : out.motion_groups) group = {};
  const auto add_run = [&](std::uint64_t slot, std::uint32_t begin, std::uint32_t count) {
    auto& group = out.motion_groups[slot >= worlds];
    const typename Sorted::Run run{world_of_slot(slot), begin, count};
    if (run.world == -1) {
      group.in_all_worlds = run;
      return;
    }
    if (group.run_count++ == 0) {
      group.first_run = run_count;
      group.begin = begin;
    }
    group.count += count;
    out.runs[run_count++] = run;
  };
  if (worlds <= 2 * std::uint64_t{n} + 1024) {
    std::uint64_t* at = out.slots.ensure(2 * worlds + 1);
    std::fill(at, at + 2 * worlds, 0);
    for (std::uint32_t i = 0; i < n; ++i) {
      const Box box = boxes[i];
      if (base::is_active(box))
        ++at[slot_of(i)];
      else
        report.add_inactive(i, base::has_nan(box), is_second);
    }
    // worlds <= 2^31 + 1, as a world is an int32: slots are below 2^33, in 64 bits throughout.
    out.runs.ensure(2 * worlds);
    for (std::uint64_t s = 0; s < 2 * worlds; ++s) {
      const auto count = static_cast<std::uint32_t>(at[s]);
      at[s] = active;
      if (count) add_run(s, active, count);
      active += count;
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      if (base::is_active(boxes[i])) ids[at[slot_of(i)]++] = i;
    }
  } else {
    // Slots below 2^33 and ids below 2^32 do not fit one 64-bit key: sort ids by slot, then by id.
    for (std::uint32_t i = 0; i < n; ++i) {
      const Box box = boxes[i];
      if (base::is_active(box))
        ids[active++] = i;
      else
        report.add_inactive(i, base::has_nan(box), is_second);
    }
    std::sort(ids, ids + active, [&](std::uint32_t x, std::uint32_t y) {
      const std::uint64_t sx = slot_of(x), sy = slot_of(y);
      return sx != sy ? sx < sy : x < y;
    });
    out.runs.ensure(active + 1);
    for (std::uint32_t begin = 0, end; begin < active; begin = end) {
      const std::uint64_t slot = slot_of(ids[begin]);
      for (end = begin + 1; end < active && slot_of(ids[end]) == slot;) ++end;
      add_run(slot, begin, end - begin);
    }
  }
  // Boxes of world -1 lie directly before those of single worlds, also where either set is empty.
  for (auto& group : out.motion_groups) {
    if (group.in_all_worlds.count == 0) group.in_all_worlds.begin = group.begin;
    if (group.count == 0) group.begin = group.in_all_worlds.begin + group.in_all_worlds.count;
  }
}

void FilterPartition::add(const BoxSubset& queries, const BoxSubset& targets, bool self) {
  if (queries.count == 0 || (targets.count == 0 && !(self && queries.count > 1))) return;
  problems_.grow(problem_count_ + 1, problem_count_);
  problems_[problem_count_++] = {queries, targets, self, nullptr};
}

void FilterPartition::add_same_worlds(const Sorted& a, unsigned group_a, const Sorted& b,
                                      unsigned group_b, bool self) {
  const Sorted::MotionGroup& ka = a.motion_groups[group_a];
  const Sorted::MotionGroup& kb = b.motion_groups[group_b];
  std::uint32_t j = 0;
  for (std::uint32_t i = 0; i < ka.run_count; ++i) {
    const Sorted::Run& run = a.runs[ka.first_run + i];
    while (j < kb.run_count && b.runs[kb.first_run + j].world < run.world) ++j;
    const bool found = j < kb.run_count && b.runs[kb.first_run + j].world == run.world;
    add(a.side(run), found ? b.side(b.runs[kb.first_run + j]) : BoxSubset{b.boxes, nullptr, 0},
        self);
  }
}

void FilterPartition::add_one_set() {
  const Sorted::MotionGroup& movers = a_.motion_groups[0];
  const Sorted::MotionGroup& fixed = a_.motion_groups[1];
  add_same_worlds(a_, 0, a_, 1, true);
  add(a_.side(movers.in_all_worlds), a_.side(fixed.in_all_worlds), true);
  add(a_.side(movers.in_all_worlds), a_.all(movers), false);
  add(a_.side(movers.in_all_worlds), a_.all(fixed), false);
  add(a_.side(fixed.in_all_worlds), a_.all(movers), false);
}

void FilterPartition::two_sets() {
  for (const auto& [ka, kb] : {std::pair{0u, 0u}, std::pair{0u, 1u}, std::pair{1u, 0u}}) {
    add_same_worlds(a_, ka, b_, kb, false);
    add(a_.side(a_.motion_groups[ka].in_all_worlds), b_.all_and_in_all_worlds(b_.motion_groups[kb]),
        false);
    add(a_.all(a_.motion_groups[ka]), b_.side(b_.motion_groups[kb].in_all_worlds), false);
  }
}

void FilterPartition::split(const Search& search, BinReport& report) {
  problem_count_ = 0;
  BinReport second;
  sort(*search.a, false, a_, report);
  if (search.two_sets) {
    sort(*search.b, true, b_, second);
    report.add(second);
    two_sets();
  } else {
    add_one_set();
  }
}

std::size_t FilterPartition::estimate_pair_count(Search& search, Algorithm algorithm,
                                                 Worker& worker) const {
  return grid::estimate_pair_count(
      search, worker, problem_count_, [this](std::uint32_t i) { return box_count(problems_[i]); },
      [&](std::uint32_t i) {
        solve_on_one_worker(search, problems_[i], make_plan(search, problems_[i], algorithm),
                            worker, 1);
      });
}

}  // namespace throng::grid
