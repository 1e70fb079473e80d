#include "apps/stream/solver.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include <throng/large_pages.hpp>

#include <fmt/format.h>

#include "apps/common/failure.hpp"
#include "apps/common/failure_text.hpp"

namespace throng::stream {
namespace {

// Each cut must pay for itself by its estimate; this limits the depth where samples are repeatedly
// wrong.
constexpr int max_depth = 12;
// Smaller searches are not halved: the library's minimum no longer decreases.
constexpr std::size_t min_rows = 64;
// Work per row, for the progress: cutting into slabs, and searching.
constexpr double cut_work_per_row = 1, search_work_per_row = 2;

common::HintOptions hint_options_of(const Options& options) {
  return {.nan = true,
          .inverted = true,
          .memory = true,
          .backend = true,
          .isa = options.isa == Isa::automatic ? "" : to_string(options.isa)};
}

}  // namespace

struct Solver::Lists {
  std::vector<Part> owned[2], halo[2];
  Part wide[2];
  std::uint64_t nan = 0, first_nan = 0;
  std::uint64_t inverted = 0, first_inverted = 0;
  int nan_side = 0;
};

Solver::Solver(const SolverSizes& sizes, const Options& options, Scratch& scratch,
               PairOutput& output, std::function<void(double)> progress, Search search)
    : sizes_(sizes),
      options_(options),
      refuses_inverted_(options.inverted == InvertedPolicy::refuse),
      scratch_(scratch),
      output_(output),
      progress_(std::move(progress)),
      search_(std::move(search)),
      arena_(sizes.arena_bytes, large_pages()),
      owned_bytes_limit_(sizes.arena_bytes / 4 * 3) {
  options_.order = Order::any;
  options_.memory_cap_bytes = sizes.finder_bytes;
  options_.concurrent_consumer = true;
  options_.inverted = InvertedPolicy::inactive;  // refused or excluded before a search
  finder_.set_options(options_);
}

void Solver::advance(double work) {
  work_done_ += work;
  // More work may turn up later: reported progress never decreases.
  if (work_ > 0)
    reported_progress_ = std::max(reported_progress_, std::min(work_done_ / work_, 1.0));
  progress_(reported_progress_);
}

std::uint64_t Solver::rows_of(const Problem& p) const {
  return p.side[0]->count() + (p.self ? 0 : p.side[1]->count());
}

bool Solver::fits(const Problem& p, std::size_t bytes) const {
  std::uint64_t needed = 0;
  for (int side = 0; side < (p.self ? 1 : 2); ++side) {
    needed += p.side[side]->count() * p.layout[side]->bytes;
  }
  return needed <= bytes;
}

Solver::InputCounts Solver::solve_frame(const Problem& problem) {
  name_ = problem.name;
  counts_ = {};
  work_done_ = reported_progress_ = 0;
  work_ = static_cast<double>(rows_of(problem)) * (cut_work_per_row + search_work_per_row);
  const Split split = choose(problem);
  slabs_ += static_cast<std::uint64_t>(split.slabs());
  divide(problem, split, 0);
  return counts_;
}

Split Solver::choose(const Problem& p) {
  SplitRequest request;
  std::size_t widest = 1;
  request.side_count = p.self ? 1 : 2;
  for (int side = 0; side < request.side_count; ++side) {
    request.sides[side] = p.side[side];
    request.layouts[side] = p.layout[side];
    widest = std::max(widest, p.layout[side]->bytes);
  }
  request.slab_rows = owned_bytes_limit_ / widest;
  // While rows are distributed, the arena holds one block to read and one extent per list.
  const auto extents = static_cast<int>(sizes_.arena_bytes / scratch_.extent_bytes());
  request.max_slabs = std::max(2, ((extents - 1) / request.side_count - 1) / 2);
  request.sample_rows = sizes_.sample_rows;
  request.margin = options_.margin;
  return choose_split(request);
}

void Solver::solve(const Problem& problem, int depth) {
  if (rows_of(problem) == 0 ||
      (!problem.self && (problem.side[0]->count() == 0 || problem.side[1]->count() == 0))) {
    return;
  }
  if (fits(problem, sizes_.arena_bytes)) {
    const Rows a = load(*problem.side[0], *problem.layout[0], 0,
                        static_cast<std::size_t>(problem.side[0]->count()), 0);
    if (problem.self) {
      search(a, nullptr, PairOrder::by_index);
    } else {
      const Rows b =
          load(*problem.side[1], *problem.layout[1], 0,
               static_cast<std::size_t>(problem.side[1]->count()), a.count * a.layout->bytes);
      search(a, &b, PairOrder::as_found);
    }
    advance(search_work_per_row * static_cast<double>(rows_of(problem)));
    return;
  }
  const Split split = depth < max_depth ? choose(problem) : Split{};
  if (split.borders.empty()) return solve_in_blocks(problem);
  work_ += cut_work_per_row * static_cast<double>(rows_of(problem));
  divide(problem, split, depth);
}

void Solver::divide(const Problem& problem, const Split& split, int depth) {
  Lists lists;
  const int sides = problem.self ? 1 : 2;
  for (int side = 0; side < sides; ++side) {
    distribute(problem, side, split, lists);
    if (lists.nan != 0 && options_.nan == NanPolicy::refuse) {
      throw common::Failure(fmt::format(
          "{}: {} boxes have a NaN, the first is box {}{}; fix them, or treat them as inactive by "
          "--nan inactive",
          name_, lists.nan, lists.first_nan,
          problem.self ? "" : (side == 0 ? " of the first set" : " of the second set")));
    }
    if (lists.inverted != 0 && refuses_inverted_) {
      throw common::Failure(fmt::format(
          "{}: {} boxes have lower > upper, the first is box {}{}; for empty slots use --inverted "
          "inactive",
          name_, lists.inverted, lists.first_inverted,
          problem.self ? "" : (side == 0 ? " of the first set" : " of the second set")));
    }
  }
  for (int s = 0; s < split.slabs(); ++s) slab(problem, split, lists, s, depth);
  Problem wide = problem;
  for (int side = 0; side < sides; ++side) wide.side[side] = &lists.wide[side];
  solve(wide, depth + 1);
}

// Distributes every active row of a side to its lists.
void Solver::distribute(const Problem& problem, int side, const Split& split, Lists& lists) {
  const Layout& layout = *problem.layout[side];
  Source& source = *problem.side[side];
  const auto slabs = static_cast<std::size_t>(split.slabs());
  const std::size_t extent = scratch_.extent_bytes();
  char* waiting = arena_.data() + extent;
  const auto make = [&] {
    Part part(scratch_, layout.bytes);
    part.begin(waiting);
    waiting += extent;
    return part;
  };
  std::vector<Part>& owned = lists.owned[side];
  std::vector<Part>& halo = lists.halo[side];
  Part& wide = lists.wide[side];
  for (std::size_t s = 0; s < slabs; ++s) owned.push_back(make());
  for (std::size_t s = 0; s < slabs; ++s) halo.push_back(make());
  wide = make();
  const std::size_t block = extent / layout.bytes;
  const std::uint64_t count = source.count();
  for (std::uint64_t at = 0; at < count; at += block) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(block, count - at));
    source.read(at, here, arena_.data());
    for (std::size_t i = 0; i < here; ++i) {
      const char* row = arena_.data() + i * layout.bytes;
      const Box box = Rows::box_of(row);
      if (!is_active(box)) {
        ++counts_.inactive;
        if (has_nan(box)) {
          if (lists.nan++ == 0) lists.first_nan = at + i;
        } else if (lists.inverted++ == 0) {
          lists.first_inverted = at + i;
        }
        continue;
      }
      const int first = split.owner(box), last = split.last(box, first);
      if (last - first > Split::max_halos) {
        wide.add(row);
        continue;
      }
      owned[static_cast<std::size_t>(first)].add(row);
      for (int s = first + 1; s <= last; ++s) halo[static_cast<std::size_t>(s)].add(row);
    }
    advance(cut_work_per_row * static_cast<double>(here));
  }
  for (Part& part : owned) part.seal();
  for (Part& part : halo) part.seal();
  wide.seal();
}

// Reports the pairs of slab s.
void Solver::slab(const Problem& problem, const Split& split, Lists& lists, int s, int depth) {
  const auto at = static_cast<std::size_t>(s);
  const int sides = problem.self ? 1 : 2;
  Problem owned = problem;
  for (int side = 0; side < sides; ++side) owned.side[side] = &lists.owned[side][at];
  const bool whole = fits(owned, owned_bytes_limit_);
  if (!whole) solve(owned, depth + 1);
  std::size_t used = 0;
  Rows rows[2];
  if (whole) {
    for (int side = 0; side < sides; ++side) {
      Part& part = lists.owned[side][at];
      rows[side] =
          load(part, *problem.layout[side], 0, static_cast<std::size_t>(part.count()), used);
      used += rows[side].count * rows[side].layout->bytes;
    }
    if (problem.self) {
      search(rows[0], nullptr, PairOrder::by_index);
    } else {
      search(rows[0], &rows[1], PairOrder::as_found);
    }
    advance(search_work_per_row * static_cast<double>(rows_of(owned)));
  }
  // Halo rows of the other side, or of the only one, against the owned rows.
  for (int side = 0; side < sides; ++side) {
    const int other = problem.self ? 0 : 1 - side;
    const Layout& halo_layout = *problem.layout[other];
    const PairOrder pair_order = problem.self ? PairOrder::by_index
                                 : side == 0  ? PairOrder::as_found
                                              : PairOrder::swapped;
    const auto meet = [&](const Rows& here, std::size_t bytes) {
      search_against(here, bytes, lists.halo[other][at], halo_layout, pair_order, &split, s);
      search_against(here, bytes, lists.wide[other], halo_layout, pair_order, &split, s);
    };
    if (whole) {
      meet(rows[side], used);
      continue;
    }
    Part& part = lists.owned[side][at];
    const std::size_t block = owned_bytes_limit_ / problem.layout[side]->bytes;
    for (std::uint64_t first = 0; first < part.count(); first += block) {
      const auto here = std::min<std::uint64_t>(block, part.count() - first);
      const Rows loaded =
          load(part, *problem.layout[side], first, static_cast<std::size_t>(here), 0);
      meet(loaded, loaded.count * loaded.layout->bytes);
    }
  }
  for (int side = 0; side < sides; ++side) {
    lists.owned[side][at].clear();
    lists.halo[side][at].clear();
  }
}

void Solver::solve_in_blocks(const Problem& problem) {
  const Layout& layout = *problem.layout[0];
  const Layout& other = *problem.layout[problem.self ? 0 : 1];
  Source& a = *problem.side[0];
  Source& b = *problem.side[problem.self ? 0 : 1];
  const std::size_t block = owned_bytes_limit_ / layout.bytes;
  // With one set, the blocks after each are compared with it; with two, all of the second.
  const double times = static_cast<double>(a.count()) / static_cast<double>(block);
  const double share = problem.self ? 0.5 : 1.0;
  work_ += search_work_per_row * share * times * static_cast<double>(b.count());
  for (std::uint64_t first = 0; first < a.count(); first += block) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(block, a.count() - first));
    const Rows rows = load(a, layout, first, here, 0);
    const std::size_t used = rows.count * layout.bytes;
    if (problem.self) search(rows, nullptr, PairOrder::by_index);
    const std::uint64_t after = problem.self ? first + here : 0;
    search_against(rows, used, b, other, problem.self ? PairOrder::by_index : PairOrder::as_found,
                   nullptr, 0, after);
    advance(search_work_per_row * static_cast<double>(here + b.count() - after));
  }
}

Rows Solver::load(Source& source, const Layout& layout, std::uint64_t first, std::size_t count,
                  std::size_t at) {
  const Rows rows{arena_.data() + at, count, &layout};
  source.read(first, count, rows.data);
  advance(0);
  return rows;
}

void Solver::search_against(Rows here, std::size_t used, Source& source, const Layout& layout,
                            PairOrder pair_order, const Split* split, int s, std::uint64_t first) {
  if (here.count == 0) return;
  const std::size_t rows_per_block = (sizes_.arena_bytes - used) / layout.bytes;
  for (; first < source.count(); first += rows_per_block) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(rows_per_block, source.count() - first));
    Rows halo_layout = load(source, layout, first, count, used);
    Rows met = here;
    if (split) {
      double reach = -std::numeric_limits<double>::infinity();
      std::size_t kept = 0;
      for (std::size_t i = 0; i < halo_layout.count; ++i) {
        const Box box = halo_layout.box(i);
        const int owner = split->owner(box);
        if (owner > s + Split::max_halos || split->last(box, owner) < s) continue;
        reach = std::max(reach, split->reach(box));
        halo_layout.swap(kept++, i);
      }
      halo_layout.count = kept;
      // Moves the owned rows that begin before all halo rows end to the front.
      std::size_t front = 0;
      for (std::size_t i = 0; i < here.count; ++i) {
        if (static_cast<double>(lower(here.box(i), split->axis)) <= reach) here.swap(front++, i);
      }
      met.count = front;
    }
    if (halo_layout.count != 0 && met.count != 0) search(met, &halo_layout, pair_order);
  }
}

bool Solver::try_search(const Rows& a, const Rows* b, PairOrder pair_order, Result& result) {
  const auto take = [&](const Pair* found, std::size_t count) {
    constexpr std::size_t block = 1024;
    Pair pairs[block];
    const Rows& second = b ? *b : a;
    for (std::size_t at = 0; at < count; at += block) {
      const std::size_t here = std::min(block, count - at);
      for (std::size_t i = 0; i < here; ++i) {
        std::uint32_t x = a.index(found[at + i].first), y = second.index(found[at + i].second);
        if (pair_order == PairOrder::swapped || (pair_order == PairOrder::by_index && y < x))
          std::swap(x, y);
        pairs[i] = {x, y};
      }
      output_.write(pairs, here);
    }
    return true;
  };
  ++searches_;
  const Boxes first = a.view(), others = b ? b->view() : Boxes();
  result = search_(finder_, first, b ? &others : nullptr, take);
  if (!result.ok()) return false;
  plan_ = result.plan;
  counts_.comparisons += result.comparisons;
  counts_.visited += result.visited;
  return true;
}

void Solver::search(const Rows& a, const Rows* b, PairOrder pair_order) {
  if (a.count == 0 || (b && b->count == 0)) return;
  const auto start = std::chrono::steady_clock::now();
  const PairOutput::Mark mark = output_.mark();
  Result result;
  bool done = try_search(a, b, pair_order, result);
  if (!done && result.status == Status::memory_cap_too_small) {
    output_.rewind(mark);
    finder_ = Finder(options_);  // its retained workspace may be the memory that is missing
    done = try_search(a, b, pair_order, result);
    if (!done) output_.rewind(mark);
  }
  search_ms_ +=
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  if (done) return;
  if (result.status == Status::stopped) advance(0);  // a consumer's stop reports its reason here
  const std::size_t larger = b ? std::max(a.count, b->count) : a.count;
  if (result.status != Status::memory_cap_too_small || larger < min_rows) {
    throw common::Failure(fmt::format(
        "{}: {}", name_,
        result.status == Status::memory_cap_too_small
            ? fmt::format("--memory: {} more bytes are needed; raise it",
                          result.bytes_needed -
                              std::min<std::uint64_t>(result.bytes_needed, sizes_.finder_bytes))
            : common::failure_text(result, hint_options_of(options_))));
  }
  const auto halves = [](const Rows& rows) {
    const std::size_t half = rows.count / 2;
    return std::pair{rows.part(0, half), rows.part(half, rows.count - half)};
  };
  if (!b) {
    const auto [first, second] = halves(a);
    search(first, nullptr, pair_order);
    search(second, nullptr, pair_order);
    search(first, &second, pair_order);
  } else if (a.count >= b->count) {
    const auto [first, second] = halves(a);
    search(first, b, pair_order);
    search(second, b, pair_order);
  } else {
    const auto [first, second] = halves(*b);
    search(a, &first, pair_order);
    search(a, &second, pair_order);
  }
}

}  // namespace throng::stream
