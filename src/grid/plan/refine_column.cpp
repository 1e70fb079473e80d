#include "grid/plan/refine_column.hpp"

#include <algorithm>
#include <utility>

#include "base/cost_table.hpp"
#include "grid/bin/filter_classes.hpp"
#include "grid/emit/worker.hpp"
#include "grid/plan/make_plan.hpp"
#include "grid/plan/non_pairing_subset.hpp"
#include "grid/recursion_scratch.hpp"
#include "grid/steps.hpp"

namespace throng::grid {
namespace {

using base::cost;

bool masks_have_filters(const Search& search) {
  return search.filter_classes && search.filter_classes->masks_cover_some();
}

// Estimates the boxes of a window [begin, end) that tie with the query, from a sample.
double estimate_ties(const Strip& from, std::uint32_t query, const Strip& to, std::uint32_t begin,
                     std::uint32_t end) {
  constexpr std::uint32_t max_samples = 16;
  const std::uint32_t size = end - begin, samples = std::min(size, max_samples);
  const QuantizedBox box = from.box(query);
  std::uint32_t ties = 0;
  for (std::uint32_t k = 0; k < samples; ++k) {
    const auto target = static_cast<std::uint32_t>(begin + std::size_t{size} * k / samples);
    ties += box.least_difference(to.box(target)) == 0;
  }
  return samples == 0 ? 0 : static_cast<double>(size) * ties / samples;
}

// Estimates the cost of sweeping the targets for one query, from a sample of queries.
double estimate_sweep_ns(const SweepCost& sweep_cost, const Strip& from, const Strip& to) {
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
  return sweep_cost(windows / count) + cost.tie_ns * ties / count;
}

// Labels a strip's boxes from `first` on, for the inner search. `target_id_offset`: see Problem.
void label(const Strip& strip, std::uint32_t target_id_offset, std::uint32_t first,
           RecursionScratch& inner) {
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    inner.ids[first + i] = strip.id[i] - target_id_offset;
    inner.labels[first + i] = first + i;
  }
}

// Passes on the masks of a strip's boxes: to a grid inside the column, or to brute force.
void pass_masks(const Search& search, const Strip& strip, std::uint32_t first, bool to_grid,
                RecursionScratch& inner) {
  const bool has_filters = masks_have_filters(search);
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    const RejectMask mask = strip.target_mask[i];
    inner.masks[first + i] = to_grid ? mask.nested(has_filters) : mask.axes_only(has_filters);
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
    std::swap(inner.masks[at], inner.masks[end]);
  }
  return at - first;
}

// Solves part of a column without comparing boxes of which no two may pair; changes labels. Returns
// false, and does nothing, if there are too few of these.
bool solve_without_forbidden(Search& search, const Problem& part, Worker& worker, unsigned depth) {
  if (!search.owners && !search.filter_classes) return false;
  const NonPairingSubset forbidden(search, part);
  const std::uint32_t of_a = part.queries.count, of_b = part.targets.count;
  const double separated =
      brute_force_comparisons(part, static_cast<double>(forbidden.count(false)),
                              static_cast<double>(forbidden.count(true)));
  if (separated < cost.forbidden_share * brute_force_comparisons(part)) return false;
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
  const auto all = static_cast<double>(boxes);
  if (all < cost.refine_boxes || boxes > max_box_count) return false;
  const SweepCost& sweep_cost = *search.kernels->sweep_cost;
  double sweep_ns = 0;
  if (problem.self) sweep_ns += a.count * estimate_sweep_ns(sweep_cost, a, a);
  sweep_ns +=
      a.count * estimate_sweep_ns(sweep_cost, a, b) + b.count * estimate_sweep_ns(sweep_cost, b, a);
  if (sweep_ns < all * cost.refine_sweep_ns) return false;
  // If coordinates are mostly ties, a finer grid separates them, or nothing does.
  const unsigned max_levels =
      masks_have_filters(search) ? RejectMask::max_levels_with_filters : RejectMask::max_levels;
  const bool grid_possible = depth + 1 < max_levels;
  const double comparisons = brute_force_comparisons(problem, a.count, b.count);
  const bool brute_pays = comparisons * comparison_ns(sweep_cost) < cost.refine_share * sweep_ns;
  if (!grid_possible && !brute_pays) return false;

  RecursionScratch& inner = worker.scratch(depth + 1);
  inner.ids.ensure(boxes);
  inner.labels.ensure(boxes);
  inner.masks.ensure(boxes);
  label(a, 0, 0, inner);
  label(b, problem.target_id_offset, a.count, inner);
  const auto pass_all_masks = [&](bool to_grid) {
    pass_masks(search, a, 0, to_grid, inner);
    pass_masks(search, b, a.count, to_grid, inner);
  };
  const ParentCell parent{inner.ids.data(), inner.masks.data()};
  const auto side = [&](const Boxes* view, std::uint32_t first, std::uint32_t count) {
    return BoxSubset{view, inner.ids.data() + first, count, inner.labels.data() + first};
  };
  const Problem part{side(problem.queries.boxes, 0, a.count),
                     side(problem.targets.boxes, a.count, b.count), problem.self, &parent};
  if (grid_possible) {
    pass_all_masks(true);
    const GridPlan finer = make_plan(search, part, Algorithm::grid);
    // Copies multiply from level to level: boxes larger than their column stay in one.
    const bool grid_pays = finer.map.column_count() > 1 &&
                           finer.expected_ns <= cost.refine_share * sweep_ns &&
                           finer.replicas <= cost.refine_replicas;
    if (grid_pays) solve_on_one_worker(search, part, finer, worker, depth + 1);
    if (grid_pays || solve_without_forbidden(search, part, worker, depth)) {
      worker.use_sweep();
      return true;
    }
  }
  if (!brute_pays) return false;
  pass_all_masks(false);
  GridPlan brute;
  brute.all_pairs = true;
  solve_on_one_worker(search, part, brute, worker, depth + 1);
  worker.use_sweep();
  return true;
}

}  // namespace throng::grid
