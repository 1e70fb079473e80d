#include "grid/plan/filter_planning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/cost_table.hpp"
#include "grid/plan/make_plan.hpp"

namespace throng::grid {
namespace {

// Boxes sampled over all sets, with jitter against regular strides in their order.
struct Sample {
  struct Place {
    bool second;
    std::uint32_t id;
  };
  std::uint32_t count = 0;
  Place place[max_sample];
  Box box[max_sample];

  explicit Sample(const Search& search) {
    const std::uint64_t of_a = search.a->size();
    const std::uint64_t boxes = box_count(search);
    const std::uint64_t probes = std::min<std::uint64_t>(boxes, sample_size(boxes));
    const std::uint64_t gap = probes == 0 ? 0 : boxes / probes;
    for (std::uint64_t i = 0; i < probes; ++i) {
      const std::uint64_t jitter = static_cast<std::uint32_t>(i * 0x9e3779b1u) * gap >> 32;
      const std::uint64_t at = i * gap + jitter;
      const bool second = at >= of_a;
      const Place one{second, static_cast<std::uint32_t>(second ? at - of_a : at)};
      place[count] = one;
      box[count] = search.box(second ? *search.b : *search.a, one.id);
      count += base::is_active(box[count]);
    }
  }
};

std::int32_t world_of(const Search& search, bool second, std::uint32_t id) noexcept {
  return (second ? search.b : search.a)->filters.world[id];
}

// Sampled boxes with one world (environment) each, sorted by world.
struct ByWorld {
  struct One {
    std::int32_t world;
    std::uint32_t at;  // index in the sample
  };
  std::uint32_t count = 0;
  One one[max_sample];

  ByWorld(const Search& search, const Sample& sample) {
    for (std::uint32_t i = 0; i < sample.count; ++i) {
      one[count] = {world_of(search, sample.place[i].second, sample.place[i].id), i};
      count += one[count].world != -1;
    }
    // Not std::stable_sort, which would allocate.
    std::sort(one, one + count, [](const One& x, const One& y) {
      return x.world != y.world ? x.world < y.world : x.at < y.at;
    });
  }
  // The probability that two boxes have the same world: a box's world's share of all boxes.
  double same() const noexcept {
    double pairs = 0;
    for (std::uint32_t i = 1, run = 0; i < count; ++i) {
      run = one[i].world == one[i - 1].world ? run + 1 : 0;
      pairs += run;
    }
    return pairs / (0.5 * count * (count - 1.0));
  }
};

// Mean distance of pairs of boxes.
struct Distance {
  double sum[3] = {}, count = 0;
  void add(const Box& x, const Box& y) noexcept {
    const float a[3] = {x.lower.x, x.lower.y, x.lower.z}, b[3] = {y.lower.x, y.lower.y, y.lower.z};
    for (int k = 0; k < 3; ++k)
      sum[k] += std::min(std::fabs(double{a[k]} - double{b[k]}),
                         double{std::numeric_limits<float>::max()});
    ++count;
  }
};

// Whether boxes of one world are about as far apart as any two boxes. If not, worlds occupy
// different places, and columns per world would be mostly empty. Uses the sample and the boxes that
// follow each in memory.
bool share_one_place(const Search& search, const Sample& sample, const ByWorld& worlds) noexcept {
  Distance own, any;
  for (std::uint32_t i = 0; i + 1 < sample.count; ++i) any.add(sample.box[i], sample.box[i + 1]);
  for (std::uint32_t i = 0; i < worlds.count; ++i) {
    const auto& [world, at] = worlds.one[i];
    if (i != 0 && worlds.one[i - 1].world == world)
      own.add(sample.box[at], sample.box[worlds.one[i - 1].at]);
    const auto& [second, id] = sample.place[at];
    const Boxes& set = second ? *search.b : *search.a;
    for (const std::uint32_t next : {1u, 7u, 17u}) {
      if (set.size() - id <= next || world_of(search, second, id + next) != world) continue;
      const Box box = search.box(set, id + next);
      if (base::is_active(box)) own.add(sample.box[at], box);
    }
  }
  for (int k = 0; k < 3; ++k)
    if (own.sum[k] * any.count < base::cost.world_distance * any.sum[k] * own.count) return false;
  return true;
}

// Plans columns per world, for worlds in one place. Returns false if that does not pay: the worlds
// are in different places, or there are too many, or too many boxes are in all worlds, as every
// column has to process these.
bool plan_worlds(const Search& search, const FilterClasses& filter_classes, GridPlan& plan) {
  const std::uint64_t boxes = box_count(search);
  const std::uint64_t worlds = static_cast<std::uint64_t>(filter_classes.greatest_world()) + 1;
  if (worlds > boxes || worlds > max_columns || filter_classes.everywhere() * worlds > boxes)
    return false;
  const Sample sample(search);
  const ByWorld by_world(search, sample);
  if (by_world.count < 2 || !share_one_place(search, sample, by_world)) return false;
  const double share = std::max(1 / static_cast<double>(worlds), by_world.same());
  const auto each = static_cast<std::uint64_t>(share * static_cast<double>(boxes));
  Box box[max_sample];
  for (std::uint32_t i = 0; i < by_world.count; ++i) box[i] = sample.box[by_world.one[i].at];
  const Stats stats = measure(box, by_world.count, each, each);
  // Wider columns if there would be too many.
  for (float wider = 1; wider <= 4; wider *= 2) {
    plan =
        grid::plan(stats, *search.kernels->sweep_cost, Algorithm::grid, search.cell_scale * wider);
    if (plan.map.column_count() * worlds > max_columns) continue;
    plan.worlds = static_cast<std::uint32_t>(worlds);
    plan.expected_ns /= share;
    plan.reason = "worlds in one place, with columns per world";
    return plan.column_count() <= boxes / 4 + 64;  // each column takes memory
  }
  return false;
}

// Whether to solve static boxes as separate problems, instead of searching them with the others and
// discarding their pairs. Of the cost expected for all boxes, static pairs take the share given by
// the cost of static boxes alone and of moving boxes alone, whose square roots add up for a
// mixture.
bool separate_static_pays(const Search& search, const FilterClasses& filter_classes,
                          const GridPlan& all) {
  if (filter_classes.all_static()) return true;
  const std::uint64_t boxes = box_count(search);
  const double extra = base::cost.separation_ns * static_cast<double>(boxes);
  if (all.expected_ns <= extra) return false;
  const Sample sample(search);
  Box of_class[2][max_sample];
  std::uint32_t taken[2] = {0, 0};
  for (std::uint32_t i = 0; i < sample.count; ++i) {
    const bool is_static = filter_classes.is_static(sample.place[i].second, sample.place[i].id);
    of_class[is_static][taken[is_static]++] = sample.box[i];
  }
  double comparing[2];
  for (const unsigned k : {0, 1}) {
    const std::uint64_t count = boxes * taken[k] / std::max(sample.count, 1u);
    const GridPlan plan = grid::plan(measure(of_class[k], taken[k], count, count),
                                     *search.kernels->sweep_cost, Algorithm::grid, 1);
    comparing[k] = plan.expected_ns;
  }
  const double roots = std::sqrt(comparing[0]) + std::sqrt(comparing[1]);
  const double saved = roots == 0 ? 0 : all.expected_ns * comparing[1] / (roots * roots);
  return extra < saved;
}

}  // namespace

bool plan_with_filters(Search& search, const Problem& whole, Algorithm forced, unsigned task_count,
                       FilterClasses& filter_classes, GridPlan& plan) {
  search.owners = search.a->filters.owner && search.b->filters.owner;
  if (!FilterClasses::needed(*search.a) && !FilterClasses::needed(*search.b)) {
    plan = make_plan(search, whole, forced);
    return true;
  }
  filter_classes.read(search, task_count);
  if (search.over()) return true;
  // Worlds: columns per world; or all together if that is cheap, as it is if the worlds are in
  // different places; or one problem per world.
  bool one = !filter_classes.several_worlds() || forced != Algorithm::all_pairs;
  bool in_columns = false;
  if (one) plan = make_plan(search, whole, forced);
  if (one && filter_classes.several_worlds()) {
    GridPlan of_worlds;
    in_columns =
        plan_worlds(search, filter_classes, of_worlds) && of_worlds.expected_ns < plan.expected_ns;
    one = in_columns || plan.expected_ns <=
                            base::cost.worlds_together_ns * static_cast<double>(box_count(search));
    if (in_columns) plan = of_worlds;
  }
  if (one && filter_classes.some_static())
    one = !separate_static_pays(search, filter_classes, plan);
  search.wide_worlds = one && in_columns;
  search.any_worlds = one && !in_columns && filter_classes.several_worlds();
  filter_classes.settle(!one);
  search.filter_classes = filter_classes.forbid() ? &filter_classes : nullptr;
  return one;
}

}  // namespace throng::grid
