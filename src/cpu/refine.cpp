#include "cpu/refine.hpp"

#include <algorithm>
#include <utility>

#include "cpu/forbidden.hpp"
#include "cpu/kinds.hpp"

namespace throng::cpu {
namespace {

// Minimum numbers of boxes and cost per box of a finer grid, and of brute force: both gather boxes
// from scattered memory.
constexpr std::uint32_t least_boxes = 1024, least_boxes_brute = 128;
constexpr double least_sweep_ns = 20;
// Brute force must cost at most this share of the sweep.
constexpr double brute_worthwhile = 0.1;
// Cost of one tie, which the floats decide.
constexpr double tie_ns = 10;
// A finer grid must cost at most this share of the sweep.
constexpr double worthwhile = 0.6;
// Copies multiply from level to level: boxes larger than their column stay in one. More are allowed
// where the gain is large.
constexpr double most_replicas = 2, most_replicas_ever = 4, very_worthwhile = 0.25;

// Boxes of which no two may pair are separated if they make up at least this share of all
// comparisons.
constexpr double worth_leaving_out = 0.25;

// Maximum nesting depth. Filter classes use the bits of one level.
unsigned most_grids(const Search& search) {
  constexpr unsigned with_kinds = Worker::max_depth - 1;
  static_assert(3 * Worker::max_depth < 16 && 3 * with_kinds <= Kinds::first_bit &&
                Kinds::first_bit + Kinds::bit_count < 16);
  return search.kinds && search.kinds->words_tell() ? with_kinds : Worker::max_depth;
}

// Estimates the boxes of a window [begin, end) that tie with the query, from a sample.
double ties_in(const Strip& from, std::uint32_t query, const Strip& to, std::uint32_t begin,
               std::uint32_t end) {
  constexpr std::uint32_t most_looks = 16;
  const std::uint32_t size = end - begin, looks = std::min(size, most_looks);
  std::uint32_t ties = 0;
  for (std::uint32_t k = 0; k < looks; ++k) {
    const std::size_t target = begin + std::size_t{size} * k / looks;
    int least = 1;
    for (int axis = 0; axis < 3; ++axis) {
      least = std::min({least, from.upper[axis][query] - to.lower[axis][target],
                        to.upper[axis][target] - from.lower[axis][query]});
    }
    ties += least == 0;
  }
  return looks == 0 ? 0 : static_cast<double>(size) * ties / looks;
}

// Estimates the cost of sweeping the targets for one query, from a sample of queries.
double sweep_ns_of(const core::SweepCost& cost, const Strip& from, const Strip& to) {
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
    if (from.upper[0][i] == from.lower[0][i]) ties += ties_in(from, i, to, begin, end);
    ++count;
  }
  return cost(windows / count) + tie_ns * ties / count;
}

// Labels a strip's boxes from `first` on, for the inner search. `raised_by`: see Problem.
void label(const Strip& strip, std::uint32_t raised_by, std::uint32_t first, Level& inner) {
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    inner.ids[first + i] = strip.id[i] - raised_by;
    inner.labels[first + i] = first + i;
  }
}

// Passes on on which axes a strip's boxes start in an earlier column: three bits per level; an
// inner level adds its own as the lowest. The bits of filter classes are set again there.
void tell_begins(const Search& search, const Strip& strip, std::uint32_t first, unsigned inner_bits,
                 Level& inner) {
  constexpr int all = (1 << 3 * Worker::max_depth) - 1, with_kinds = (1 << Kinds::first_bit) - 1;
  const int of_grids = search.kinds && search.kinds->words_tell() ? with_kinds : all;
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    const int before = (strip.begins[i] & of_grids) << inner_bits;
    inner.before[first + i] = static_cast<std::uint16_t>(before);
  }
}

// Moves the forbidden boxes of a side to the end; returns the number of others.
std::uint32_t move_last(Level& inner, std::uint32_t first, std::uint32_t count,
                        const Forbidden& forbidden, bool second) {
  std::uint32_t at = first, end = first + count;
  while (at < end) {
    if (!forbidden.has(second, inner.ids[at])) {
      ++at;
      continue;
    }
    --end;
    std::swap(inner.ids[at], inner.ids[end]);
    std::swap(inner.before[at], inner.before[end]);
  }
  return at - first;
}

// Solves part of a column without comparing boxes of which no two may pair; changes labels. Returns
// false, and does nothing, if there are too few of these.
bool leave_out(Search& search, const Problem& part, Worker& worker, unsigned depth) {
  if (!search.owners && !search.kinds) return false;
  const Forbidden forbidden(search, part);
  const std::uint32_t of_a = part.queries.count, of_b = part.targets.count;
  const auto comparisons = [&](double a, double b) { return (part.self ? a * a / 2 : 0) + a * b; };
  const double left_out = comparisons(static_cast<double>(forbidden.count(false)),
                                      static_cast<double>(forbidden.count(true)));
  if (left_out < worth_leaving_out * comparisons(of_a, of_b)) return false;
  Level& inner = worker.level(depth + 1);
  const std::uint32_t a = move_last(inner, 0, of_a, forbidden, false);
  const std::uint32_t b = move_last(inner, of_a, of_b, forbidden, true);
  const auto side = [&](const Boxes* boxes, std::uint32_t first, std::uint32_t count) {
    return Side{boxes, inner.ids.data() + first, count, inner.labels.data() + first};
  };
  // First the others with all, then the separated ones with the other targets. Where queries are
  // compared among themselves, targets are of the same set.
  const Boxes* const of_queries = part.queries.boxes;
  const Boxes* const of_targets = part.self ? of_queries : part.targets.boxes;
  const std::uint32_t from = part.self ? a : of_a;
  const Problem problems[] = {
      {side(of_queries, 0, a), side(of_targets, from, of_a + of_b - from), part.self, part.frame},
      {side(of_queries, a, of_a - a), side(of_targets, of_a, b), false, part.frame}};
  for (const Problem& problem : problems) {
    if (problem.queries.count == 0 || (problem.targets.count == 0 && !problem.self)) continue;
    if (search.over()) break;
    solve_alone(search, problem, make_plan(search, problem, Algorithm::grid), worker, depth + 1);
  }
  return true;
}

}  // namespace

bool refine(Search& search, const Problem& problem, Worker& worker, const Strip& a, const Strip& b,
            unsigned depth) {
  // Two sides may have more boxes than 32-bit labels: then they are swept.
  const std::size_t boxes = std::size_t{a.count} + b.count;
  if (boxes < least_boxes_brute || boxes > max_box_count) return false;
  const core::SweepCost& cost = search.kernels->sweep_cost;
  double sweep_ns = 0;
  if (problem.self) sweep_ns += a.count * sweep_ns_of(cost, a, a);
  sweep_ns += a.count * sweep_ns_of(cost, a, b) + b.count * sweep_ns_of(cost, b, a);
  if (sweep_ns < static_cast<double>(boxes) * least_sweep_ns) return false;
  // If coordinates are mostly ties, a finer grid separates them, or nothing does.
  const bool may_refine = boxes >= least_boxes && depth + 1 < most_grids(search);
  const double of_a = a.count, of_b = b.count;
  const double comparisons = (problem.self ? 0.5 * of_a * of_a : 0) + of_a * of_b;
  const double brute = comparisons * std::max(core::brute_ns, 2 * cost.long_box_ns);
  const bool may_brute = brute < brute_worthwhile * sweep_ns;
  if (!may_refine && !may_brute) return false;

  Level& inner = worker.level(depth + 1);
  inner.ids.room(boxes);
  inner.labels.room(boxes);
  inner.before.room(boxes);
  label(a, 0, 0, inner);
  label(b, problem.raised_by, a.count, inner);
  const auto tell_all_begins = [&](unsigned inner_bits) {
    tell_begins(search, a, 0, inner_bits, inner);
    tell_begins(search, b, a.count, inner_bits, inner);
  };
  const Frame frame{inner.ids.data(), inner.before.data()};
  const auto side = [&](const Boxes* view, std::uint32_t first, std::uint32_t count) {
    return Side{view, inner.ids.data() + first, count, inner.labels.data() + first};
  };
  const Problem part{side(problem.queries.boxes, 0, a.count),
                     side(problem.targets.boxes, a.count, b.count), problem.self, &frame};
  core::GridPlan finer;
  if (may_refine) finer = make_plan(search, part, Algorithm::grid);
  bool left_out = false;
  const bool pays_well = finer.expected_ns < very_worthwhile * sweep_ns;
  if (!may_refine || finer.map.column_count() <= 1 || finer.expected_ns > worthwhile * sweep_ns ||
      finer.replicas > (pays_well ? most_replicas_ever : most_replicas)) {
    if (may_refine) {
      tell_all_begins(3);
      left_out = leave_out(search, part, worker, depth);
    }
    if (!left_out && !may_brute) return false;
    if (!left_out) {
      finer.all_pairs = true;
      tell_all_begins(0);
    }
  } else {
    tell_all_begins(3);
  }
  if (!left_out) solve_alone(search, part, finer, worker, depth + 1);
  worker.by_words();
  return true;
}

}  // namespace throng::cpu
