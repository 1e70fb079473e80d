#include "grid/plan/refine_column.hpp"

#include <algorithm>
#include <utility>

#include "grid/bin/filter_classes.hpp"
#include "grid/plan/non_pairing_subset.hpp"
#include "grid/plan/plan_and_solve.hpp"
#include "grid/recursion_scratch.hpp"

namespace throng::grid {
namespace {

// Minimum numbers of boxes and cost per box of a finer grid, and of brute force: both gather boxes
// from scattered memory.
constexpr std::uint32_t min_boxes = 1024, min_boxes_brute = 128;
constexpr double min_sweep_ns = 20;
// Brute force must cost at most this share of the sweep.
constexpr double max_brute_share = 0.1;
// Cost of one tie, which the floats decide.
constexpr double tie_ns = 10;
// A finer grid must cost at most this share of the sweep.
constexpr double max_grid_share = 0.6;
// Copies multiply from level to level: boxes larger than their column stay in one. More are allowed
// where the gain is large.
constexpr double max_replicas = 2, max_replicas_large_gain = 4, large_gain_share = 0.25;

// Boxes of which no two may pair are separated if they make up at least this share of all
// comparisons.
constexpr double min_forbidden_share = 0.25;

// Maximum nesting depth. Filter classes use the bits of one level.
unsigned max_grid_depth(const Search& search) {
  constexpr unsigned with_classes = Worker::max_depth - 1;
  static_assert(3 * Worker::max_depth < 16 && 3 * with_classes <= FilterClasses::first_bit &&
                FilterClasses::first_bit + FilterClasses::bit_count < 16);
  return search.filter_classes && search.filter_classes->masks_cover_some() ? with_classes
                                                                            : Worker::max_depth;
}

// Estimates the boxes of a window [begin, end) that tie with the query, from a sample.
double estimate_ties(const Strip& from, std::uint32_t query, const Strip& to, std::uint32_t begin,
                     std::uint32_t end) {
  constexpr std::uint32_t max_samples = 16;
  const std::uint32_t size = end - begin, samples = std::min(size, max_samples);
  std::uint32_t ties = 0;
  for (std::uint32_t k = 0; k < samples; ++k) {
    const std::size_t target = begin + std::size_t{size} * k / samples;
    int least = 1;
    for (int axis = 0; axis < 3; ++axis) {
      least = std::min({least, from.upper[axis][query] - to.lower[axis][target],
                        to.upper[axis][target] - from.lower[axis][query]});
    }
    ties += least == 0;
  }
  return samples == 0 ? 0 : static_cast<double>(size) * ties / samples;
}

// Estimates the cost of sweeping the targets for one query, from a sample of queries.
double estimate_sweep_ns(const SweepCost& cost, const Strip& from, const Strip& to) {
  if (from.count == 0 || to.count == 0) return 0;
  constexpr std::uint32_t samples = 32;
  const std::uint32_t step = std::max(1u, from.count / samples);
  double windows = 0, ties = 0, count = 0;
  for (std::uint32_t i = step / 2; i < from.count; i += step) {
    const std::uint32_t last = to.bucket_of(from.upper[0][i]);
    const std::uint32_t first = to.bucket_of(from.lower[0][i]);
    const std::uint32_t end = to.bucket_end[std::min(last, to.bucket_count - 1)];
    const std::uint32_t begin = first == 0 ? 0 : to.bucket_end[first - 1];
    windows += end - begin;
    if (from.upper[0][i] == from.lower[0][i]) ties += estimate_ties(from, i, to, begin, end);
    ++count;
  }
  return cost(windows / count) + tie_ns * ties / count;
}

// Labels a strip's boxes from `first` on, for the inner search. `target_id_offset`: see Problem.
void label(const Strip& strip, std::uint32_t target_id_offset, std::uint32_t first,
           RecursionScratch& inner) {
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    inner.ids[first + i] = strip.id[i] - target_id_offset;
    inner.labels[first + i] = first + i;
  }
}

// Passes on on which axes a strip's boxes start in an earlier column: three bits per level; an
// inner level adds its own as the lowest. The bits of filter classes are set again there.
void pass_reject_bits(const Search& search, const Strip& strip, std::uint32_t first,
                      unsigned inner_bits, RecursionScratch& inner) {
  constexpr int all = (1 << 3 * Worker::max_depth) - 1,
                with_classes = (1 << FilterClasses::first_bit) - 1;
  const int of_grids =
      search.filter_classes && search.filter_classes->masks_cover_some() ? with_classes : all;
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    const int outer_bits = (strip.target_reject_bits[i] & of_grids) << inner_bits;
    inner.reject_bits[first + i] = static_cast<std::uint16_t>(outer_bits);
  }
}

// Moves the forbidden boxes of a side to the end; returns the number of others.
std::uint32_t move_forbidden_last(RecursionScratch& inner, std::uint32_t first, std::uint32_t count,
                                  const NonPairingSubset& forbidden, bool second) {
  std::uint32_t at = first, end = first + count;
  while (at < end) {
    if (!forbidden.has(second, inner.ids[at])) {
      ++at;
      continue;
    }
    --end;
    std::swap(inner.ids[at], inner.ids[end]);
    std::swap(inner.reject_bits[at], inner.reject_bits[end]);
  }
  return at - first;
}

// Solves part of a column without comparing boxes of which no two may pair; changes labels. Returns
// false, and does nothing, if there are too few of these.
bool solve_without_forbidden(Search& search, const Problem& part, Worker& worker, unsigned depth) {
  if (!search.owners && !search.filter_classes) return false;
  const NonPairingSubset forbidden(search, part);
  const std::uint32_t of_a = part.queries.count, of_b = part.targets.count;
  const auto comparisons = [&](double a, double b) { return (part.self ? a * a / 2 : 0) + a * b; };
  const double separated = comparisons(static_cast<double>(forbidden.count(false)),
                                       static_cast<double>(forbidden.count(true)));
  if (separated < min_forbidden_share * comparisons(of_a, of_b)) return false;
  RecursionScratch& inner = worker.scratch(depth + 1);
  const std::uint32_t a = move_forbidden_last(inner, 0, of_a, forbidden, false);
  const std::uint32_t b = move_forbidden_last(inner, of_a, of_b, forbidden, true);
  const auto side = [&](const Boxes* boxes, std::uint32_t first, std::uint32_t count) {
    return BoxSubset{boxes, inner.ids.data() + first, count, inner.labels.data() + first};
  };
  // First the others with all, then the separated ones with the other targets. Where queries are
  // compared among themselves, targets are of the same set.
  const Boxes* const of_queries = part.queries.boxes;
  const Boxes* const of_targets = part.self ? of_queries : part.targets.boxes;
  const std::uint32_t from = part.self ? a : of_a;
  const Problem problems[] = {
      {side(of_queries, 0, a), side(of_targets, from, of_a + of_b - from), part.self, part.parent},
      {side(of_queries, a, of_a - a), side(of_targets, of_a, b), false, part.parent}};
  for (const Problem& problem : problems) {
    if (problem.queries.count == 0 || (problem.targets.count == 0 && !problem.self)) continue;
    if (search.over()) break;
    solve_on_one_worker(search, problem, make_plan(search, problem, Algorithm::grid), worker,
                        depth + 1);
  }
  return true;
}

}  // namespace

bool refine(Search& search, const Problem& problem, Worker& worker, const Strip& a, const Strip& b,
            unsigned depth) {
  // Two sides may have more boxes than 32-bit labels: then they are swept.
  const std::size_t boxes = std::size_t{a.count} + b.count;
  if (boxes < min_boxes_brute || boxes > max_box_count) return false;
  const SweepCost& cost = search.kernels->sweep_cost;
  double sweep_ns = 0;
  if (problem.self) sweep_ns += a.count * estimate_sweep_ns(cost, a, a);
  sweep_ns += a.count * estimate_sweep_ns(cost, a, b) + b.count * estimate_sweep_ns(cost, b, a);
  if (sweep_ns < static_cast<double>(boxes) * min_sweep_ns) return false;
  // If coordinates are mostly ties, a finer grid separates them, or nothing does.
  const bool refine_possible = boxes >= min_boxes && depth + 1 < max_grid_depth(search);
  const double of_a = a.count, of_b = b.count;
  const double comparisons = (problem.self ? 0.5 * of_a * of_a : 0) + of_a * of_b;
  const double brute = comparisons * std::max(brute_force_ns, 2 * cost.long_box_ns);
  const bool brute_possible = brute < max_brute_share * sweep_ns;
  if (!refine_possible && !brute_possible) return false;

  RecursionScratch& inner = worker.scratch(depth + 1);
  inner.ids.ensure(boxes);
  inner.labels.ensure(boxes);
  inner.reject_bits.ensure(boxes);
  label(a, 0, 0, inner);
  label(b, problem.target_id_offset, a.count, inner);
  const auto pass_all_reject_bits = [&](unsigned inner_bits) {
    pass_reject_bits(search, a, 0, inner_bits, inner);
    pass_reject_bits(search, b, a.count, inner_bits, inner);
  };
  const ParentCell parent{inner.ids.data(), inner.reject_bits.data()};
  const auto side = [&](const Boxes* view, std::uint32_t first, std::uint32_t count) {
    return BoxSubset{view, inner.ids.data() + first, count, inner.labels.data() + first};
  };
  const Problem part{side(problem.queries.boxes, 0, a.count),
                     side(problem.targets.boxes, a.count, b.count), problem.self, &parent};
  GridPlan finer;
  if (refine_possible) finer = make_plan(search, part, Algorithm::grid);
  bool separated = false;
  const bool large_gain = finer.expected_ns < large_gain_share * sweep_ns;
  if (!refine_possible || finer.map.column_count() <= 1 ||
      finer.expected_ns > max_grid_share * sweep_ns ||
      finer.replicas > (large_gain ? max_replicas_large_gain : max_replicas)) {
    if (refine_possible) {
      pass_all_reject_bits(3);
      separated = solve_without_forbidden(search, part, worker, depth);
    }
    if (!separated && !brute_possible) return false;
    if (!separated) {
      finer.all_pairs = true;
      pass_all_reject_bits(0);
    }
  } else {
    pass_all_reject_bits(3);
  }
  if (!separated) solve_on_one_worker(search, part, finer, worker, depth + 1);
  worker.use_sweep();
  return true;
}

}  // namespace throng::grid
