// What filters keep apart, and how: worlds, and static boxes from those that move.
#include <algorithm>
#include <cmath>

#include "cpu/grid.hpp"

namespace throng::cpu {
namespace {

// Boxes of all sets, spread over all, off any regular stride that their order may have.
struct Sample {
  struct Place {
    bool second;
    std::uint32_t id;
  };
  std::uint32_t count = 0;
  Place place[core::max_sample];
  Box box[core::max_sample];

  explicit Sample(const Search& search) {
    const std::uint64_t of_a = search.a->size();
    const std::uint64_t boxes = box_count(search);
    const std::uint64_t probes = std::min<std::uint64_t>(boxes, core::max_sample);
    const std::uint64_t gap = probes == 0 ? 0 : boxes / probes;
    for (std::uint64_t i = 0; i < probes; ++i) {
      const std::uint64_t jitter = static_cast<std::uint32_t>(i * 0x9e3779b1u) * gap >> 32;
      const std::uint64_t at = i * gap + jitter;
      const bool second = at >= of_a;
      const Place one{second, static_cast<std::uint32_t>(second ? at - of_a : at)};
      place[count] = one;
      box[count] = search.box(second ? *search.b : *search.a, one.id);
      count += core::is_active(box[count]);
    }
  }
};

}  // namespace

bool plan_worlds(const Search& search, const Kinds& kinds, core::GridPlan& plan) {
  const std::uint64_t boxes = box_count(search);
  const std::uint64_t worlds = static_cast<std::uint64_t>(kinds.greatest_world()) + 1;
  // Every column of a world is shown the boxes that are of all.
  if (worlds > boxes || worlds > most_columns || kinds.everywhere() * worlds > boxes) return false;
  const Sample sample(search);
  const auto world_at = [&](bool second, std::uint32_t id) {
    return (second ? search.b : search.a)->filters.world[id];
  };
  std::uint32_t order[core::max_sample], count = 0;
  std::int32_t world[core::max_sample];
  for (std::uint32_t i = 0; i < sample.count; ++i) {
    world[i] = world_at(sample.place[i].second, sample.place[i].id);
    order[count] = i;
    count += world[i] != -1;
  }
  if (count < 2) return false;

  // How far boxes of one world lie apart, and any two: those of the sample, and what follows in
  // memory. Where that is far less, worlds have places of their own, and their columns would be
  // mostly empty.
  double own[3] = {}, any[3] = {}, own_count = 0;
  const auto add = [](double(&to)[3], const Box& x, const Box& y) {
    const double lower[3] = {x.lower.x, x.lower.y, x.lower.z},
                 other[3] = {y.lower.x, y.lower.y, y.lower.z};
    for (int k = 0; k < 3; ++k) to[k] += std::min(std::fabs(lower[k] - other[k]), 1e30);
  };
  for (std::uint32_t i = 0; i + 1 < count; ++i)
    add(any, sample.box[order[i]], sample.box[order[i + 1]]);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto [second, id] = sample.place[order[i]];
    const Boxes& set = second ? *search.b : *search.a;
    for (const std::uint32_t next : {1u, 7u, 17u}) {
      if (set.size() - id <= next || world_at(second, id + next) != world[order[i]]) continue;
      const Box box = search.box(set, id + next);
      if (!core::is_active(box)) continue;
      add(own, sample.box[order[i]], box);
      ++own_count;
    }
  }
  std::sort(order, order + count,
            [&](std::uint32_t i, std::uint32_t j) { return world[i] < world[j]; });
  // How many boxes the world of a box has: by the chance that two boxes are of one world.
  double same = 0;
  std::uint32_t run = 0;
  for (std::uint32_t i = 1; i < count; ++i) {
    run = world[order[i]] == world[order[i - 1]] ? run + 1 : 0;
    same += run;
    if (run == 0) continue;
    add(own, sample.box[order[i]], sample.box[order[i - 1]]);
    ++own_count;
  }
  constexpr double least_share = 0.25;
  for (int k = 0; k < 3; ++k) {
    if (own[k] / std::max(own_count, 1.0) < least_share * any[k] / (count - 1) && own_count != 0)
      return false;
  }
  const double pairs = 0.5 * count * (count - 1.0);
  const double of_one = std::max(static_cast<double>(boxes) / static_cast<double>(worlds),
                                 static_cast<double>(boxes) * same / pairs);
  Box box[core::max_sample];
  for (std::uint32_t i = 0; i < count; ++i) box[i] = sample.box[order[i]];
  const auto each = static_cast<std::uint64_t>(of_one);
  const core::Stats stats = core::measure(box, count, each, each);
  // Wider columns where there would be too many.
  for (float wider = 1; wider <= 4; wider *= 2) {
    plan =
        core::plan(stats, search.kernels->sweep_cost, Algorithm::grid, search.cell_scale * wider);
    if (plan.map.column_count() * worlds > most_columns) continue;
    plan.worlds = static_cast<std::uint32_t>(worlds);
    plan.expected_ns *= static_cast<double>(boxes) / of_one;
    plan.reason = "worlds in one place, each with columns of its own";
    return plan.column_count() <= 2 * boxes + 64;
  }
  return false;
}

// Of what is expected of all boxes, two that are static have the share that comes of their cost
// alone and that of those that move alone, the roots of which add up where both are mixed. Without
// them the rest costs about 1.3 times as much, and sorting boxes and more grids some 25 ns a box.
bool static_better_apart(const Search& search, const Kinds& kinds, const core::GridPlan& all) {
  if (kinds.all_static()) return true;
  constexpr double dearer = 1.3, apart_ns = 25, enter_ns = 5;
  const std::uint64_t boxes = box_count(search);
  const double extra = apart_ns * static_cast<double>(boxes);
  if (all.expected_ns <= extra) return false;
  const Sample sample(search);
  Box of_kind[2][core::max_sample];
  std::uint32_t taken[2] = {0, 0};
  for (std::uint32_t i = 0; i < sample.count; ++i) {
    const bool is_static = kinds.is_static(sample.place[i].second, sample.place[i].id);
    of_kind[is_static][taken[is_static]++] = sample.box[i];
  }
  // What it costs to compare the boxes of each, beyond entering them into a grid.
  double comparing[2];
  for (const unsigned k : {0, 1}) {
    const std::uint64_t count = boxes * taken[k] / std::max(sample.count, 1u);
    const core::GridPlan plan = core::plan(core::measure(of_kind[k], taken[k], count, count),
                                           search.kernels->sweep_cost, Algorithm::grid, 1);
    comparing[k] = std::max(0.0, plan.expected_ns - enter_ns * static_cast<double>(count));
  }
  const double roots = std::sqrt(comparing[0]) + std::sqrt(comparing[1]);
  const double saved = roots == 0 ? 0 : all.expected_ns * comparing[1] / (roots * roots);
  return dearer * (all.expected_ns - saved) + extra < all.expected_ns;
}

}  // namespace throng::cpu
