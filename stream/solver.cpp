#include "stream/solver.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include <throng/large_pages.hpp>

#include <fmt/format.h>

#include "program/failure.hpp"
#include "program/remedy.hpp"

namespace throng::stream {
namespace {

// Each cut must pay for itself by its estimate; this limits the depth where samples are repeatedly
// wrong.
constexpr int most_cuts = 12;
// Smaller searches are not halved: the library's minimum no longer decreases.
constexpr std::size_t least_rows = 64;
// Work per row, for the progress: cutting into slabs, and searching.
constexpr double work_to_cut = 1, work_to_search = 2;

program::Remedies remedies_of(const Options& options) {
  return {.nan = true,
          .inverted = true,
          .memory = true,
          .backend = true,
          .isa = options.isa == Isa::automatic ? "" : to_string(options.isa)};
}

}  // namespace

struct Solver::Lists {
  std::vector<Part> home[2], halo[2];
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
      room_(sizes.room_bytes, large_pages()),
      home_bytes_(sizes.room_bytes / 4 * 3) {
  options_.order = Order::any;
  options_.memory_cap_bytes = sizes.finder_bytes;
  options_.concurrent_consumer = true;
  options_.inverted = InvertedPolicy::inactive;  // refused or excluded before a search
  finder_.set_options(options_);
}

void Solver::advance(double work) {
  work_done_ += work;
  // More work may turn up later: reported progress never decreases.
  if (work_ > 0) share_ = std::max(share_, std::min(work_done_ / work_, 1.0));
  progress_(share_);
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

Solver::Seen Solver::solve_frame(const Problem& problem) {
  name_ = problem.name;
  seen_ = {};
  work_done_ = share_ = 0;
  work_ = static_cast<double>(rows_of(problem)) * (work_to_cut + work_to_search);
  const Split split = choose(problem);
  slabs_ += static_cast<std::uint64_t>(split.slabs());
  divide(problem, split, 0);
  return seen_;
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
  request.slab_rows = home_bytes_ / widest;
  // While rows are distributed, the arena holds one block to read and one extent per list.
  const auto extents = static_cast<int>(sizes_.room_bytes / scratch_.extent_bytes());
  request.most_slabs = std::max(2, ((extents - 1) / request.side_count - 1) / 2);
  request.sample_rows = sizes_.sample_rows;
  request.margin = options_.margin;
  return choose_split(request);
}

void Solver::solve(const Problem& problem, int depth) {
  if (rows_of(problem) == 0 ||
      (!problem.self && (problem.side[0]->count() == 0 || problem.side[1]->count() == 0))) {
    return;
  }
  if (fits(problem, sizes_.room_bytes)) {
    const Rows a = load(*problem.side[0], *problem.layout[0], 0,
                        static_cast<std::size_t>(problem.side[0]->count()), 0);
    if (problem.self) {
      search(a, nullptr, Told::by_index);
    } else {
      const Rows b =
          load(*problem.side[1], *problem.layout[1], 0,
               static_cast<std::size_t>(problem.side[1]->count()), a.count * a.layout->bytes);
      search(a, &b, Told::as_found);
    }
    advance(work_to_search * static_cast<double>(rows_of(problem)));
    return;
  }
  const Split split = depth < most_cuts ? choose(problem) : Split{};
  if (split.borders.empty()) return in_blocks(problem);
  work_ += work_to_cut * static_cast<double>(rows_of(problem));
  divide(problem, split, depth);
}

void Solver::divide(const Problem& problem, const Split& split, int depth) {
  Lists lists;
  const int sides = problem.self ? 1 : 2;
  for (int side = 0; side < sides; ++side) {
    distribute(problem, side, split, lists);
    if (lists.nan != 0 && options_.nan == NanPolicy::refuse) {
      throw program::Failure(fmt::format(
          "{}: {} boxes have a NaN, the first is box {}{}; fix them, or treat them as inactive by "
          "--nan inactive",
          name_, lists.nan, lists.first_nan,
          problem.self ? "" : (side == 0 ? " of the first set" : " of the second set")));
    }
    if (lists.inverted != 0 && refuses_inverted_) {
      throw program::Failure(fmt::format(
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
  char* waiting = room_.data() + extent;
  const auto make = [&] {
    Part part(scratch_, layout.bytes);
    part.begin(waiting);
    waiting += extent;
    return part;
  };
  std::vector<Part>& home = lists.home[side];
  std::vector<Part>& halo = lists.halo[side];
  Part& wide = lists.wide[side];
  for (std::size_t s = 0; s < slabs; ++s) home.push_back(make());
  for (std::size_t s = 0; s < slabs; ++s) halo.push_back(make());
  wide = make();
  const std::size_t block = extent / layout.bytes;
  const std::uint64_t count = source.count();
  for (std::uint64_t at = 0; at < count; at += block) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(block, count - at));
    source.read(at, here, room_.data());
    for (std::size_t i = 0; i < here; ++i) {
      const char* row = room_.data() + i * layout.bytes;
      const Box box = Rows::box_of(row);
      if (!is_active(box)) {
        ++seen_.inactive;
        if (has_nan(box)) {
          if (lists.nan++ == 0) lists.first_nan = at + i;
        } else if (lists.inverted++ == 0) {
          lists.first_inverted = at + i;
        }
        continue;
      }
      const int first = split.home(box), last = split.last(box, first);
      if (last - first > Split::most_halos) {
        wide.add(row);
        continue;
      }
      home[static_cast<std::size_t>(first)].add(row);
      for (int s = first + 1; s <= last; ++s) halo[static_cast<std::size_t>(s)].add(row);
    }
    advance(work_to_cut * static_cast<double>(here));
  }
  for (Part& part : home) part.seal();
  for (Part& part : halo) part.seal();
  wide.seal();
}

// Reports the pairs of slab s.
void Solver::slab(const Problem& problem, const Split& split, Lists& lists, int s, int depth) {
  const auto at = static_cast<std::size_t>(s);
  const int sides = problem.self ? 1 : 2;
  Problem home = problem;
  for (int side = 0; side < sides; ++side) home.side[side] = &lists.home[side][at];
  const bool whole = fits(home, home_bytes_);
  if (!whole) solve(home, depth + 1);
  std::size_t used = 0;
  Rows rows[2];
  if (whole) {
    for (int side = 0; side < sides; ++side) {
      Part& part = lists.home[side][at];
      rows[side] =
          load(part, *problem.layout[side], 0, static_cast<std::size_t>(part.count()), used);
      used += rows[side].count * rows[side].layout->bytes;
    }
    if (problem.self) {
      search(rows[0], nullptr, Told::by_index);
    } else {
      search(rows[0], &rows[1], Told::as_found);
    }
    advance(work_to_search * static_cast<double>(rows_of(home)));
  }
  // Halo rows of the other side, or of the only one, against the owned rows.
  for (int side = 0; side < sides; ++side) {
    const int other = problem.self ? 0 : 1 - side;
    const Layout& guests = *problem.layout[other];
    const Told told = problem.self ? Told::by_index : side == 0 ? Told::as_found : Told::swapped;
    const auto meet = [&](const Rows& here, std::size_t bytes) {
      pass_by(here, bytes, lists.halo[other][at], guests, told, &split, s);
      pass_by(here, bytes, lists.wide[other], guests, told, &split, s);
    };
    if (whole) {
      meet(rows[side], used);
      continue;
    }
    Part& part = lists.home[side][at];
    const std::size_t block = home_bytes_ / problem.layout[side]->bytes;
    for (std::uint64_t first = 0; first < part.count(); first += block) {
      const auto here = std::min<std::uint64_t>(block, part.count() - first);
      const Rows loaded =
          load(part, *problem.layout[side], first, static_cast<std::size_t>(here), 0);
      meet(loaded, loaded.count * loaded.layout->bytes);
    }
  }
  for (int side = 0; side < sides; ++side) {
    lists.home[side][at].clear();
    lists.halo[side][at].clear();
  }
}

void Solver::in_blocks(const Problem& problem) {
  const Layout& layout = *problem.layout[0];
  const Layout& other = *problem.layout[problem.self ? 0 : 1];
  Source& a = *problem.side[0];
  Source& b = *problem.side[problem.self ? 0 : 1];
  const std::size_t block = home_bytes_ / layout.bytes;
  // With one set, the blocks after each are compared with it; with two, all of the second.
  const double times = static_cast<double>(a.count()) / static_cast<double>(block);
  const double share = problem.self ? 0.5 : 1.0;
  work_ += work_to_search * share * times * static_cast<double>(b.count());
  for (std::uint64_t first = 0; first < a.count(); first += block) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(block, a.count() - first));
    const Rows rows = load(a, layout, first, here, 0);
    const std::size_t used = rows.count * layout.bytes;
    if (problem.self) search(rows, nullptr, Told::by_index);
    const std::uint64_t after = problem.self ? first + here : 0;
    pass_by(rows, used, b, other, problem.self ? Told::by_index : Told::as_found, nullptr, 0,
            after);
    advance(work_to_search * static_cast<double>(here + b.count() - after));
  }
}

Rows Solver::load(Source& source, const Layout& layout, std::uint64_t first, std::size_t count,
                  std::size_t at) {
  const Rows rows{room_.data() + at, count, &layout};
  source.read(first, count, rows.data);
  advance(0);
  return rows;
}

void Solver::pass_by(Rows here, std::size_t used, Source& source, const Layout& layout, Told told,
                     const Split* split, int s, std::uint64_t first) {
  if (here.count == 0) return;
  const std::size_t room = (sizes_.room_bytes - used) / layout.bytes;
  for (; first < source.count(); first += room) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(room, source.count() - first));
    Rows guests = load(source, layout, first, count, used);
    Rows met = here;
    if (split) {
      double reach = -std::numeric_limits<double>::infinity();
      std::size_t kept = 0;
      for (std::size_t i = 0; i < guests.count; ++i) {
        const Box box = guests.box(i);
        const int home = split->home(box);
        if (home > s + Split::most_halos || split->last(box, home) < s) continue;
        reach = std::max(reach, split->reach(box));
        guests.swap(kept++, i);
      }
      guests.count = kept;
      // Moves the owned rows that begin before all halo rows end to the front.
      std::size_t front = 0;
      for (std::size_t i = 0; i < here.count; ++i) {
        if (static_cast<double>(lower(here.box(i), split->axis)) <= reach) here.swap(front++, i);
      }
      met.count = front;
    }
    if (guests.count != 0 && met.count != 0) search(met, &guests, told);
  }
}

bool Solver::try_search(const Rows& a, const Rows* b, Told told, Result& result) {
  const auto take = [&](const Pair* found, std::size_t count) {
    constexpr std::size_t block = 1024;
    Pair pairs[block];
    const Rows& second = b ? *b : a;
    for (std::size_t at = 0; at < count; at += block) {
      const std::size_t here = std::min(block, count - at);
      for (std::size_t i = 0; i < here; ++i) {
        std::uint32_t x = a.index(found[at + i].first), y = second.index(found[at + i].second);
        if (told == Told::swapped || (told == Told::by_index && y < x)) std::swap(x, y);
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
  seen_.comparisons += result.comparisons;
  seen_.visited += result.visited;
  return true;
}

void Solver::search(const Rows& a, const Rows* b, Told told) {
  if (a.count == 0 || (b && b->count == 0)) return;
  const auto start = std::chrono::steady_clock::now();
  const PairOutput::Mark mark = output_.mark();
  Result result;
  bool done = try_search(a, b, told, result);
  if (!done && result.status == Status::memory_cap_too_small) {
    output_.take_back(mark);
    finder_ = Finder(options_);  // its retained workspace may be the memory that is missing
    done = try_search(a, b, told, result);
    if (!done) output_.take_back(mark);
  }
  search_ms_ +=
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  if (done) return;
  if (result.status == Status::stopped) advance(0);  // a consumer's stop reports its reason here
  const std::size_t larger = b ? std::max(a.count, b->count) : a.count;
  if (result.status != Status::memory_cap_too_small || larger < least_rows) {
    throw program::Failure(fmt::format(
        "{}: {}", name_,
        result.status == Status::memory_cap_too_small
            ? fmt::format("--memory: {} more bytes are needed; raise it",
                          result.bytes_needed -
                              std::min<std::uint64_t>(result.bytes_needed, sizes_.finder_bytes))
            : program::failure_text(result, remedies_of(options_))));
  }
  const auto halves = [](const Rows& rows) {
    const std::size_t half = rows.count / 2;
    return std::pair{rows.part(0, half), rows.part(half, rows.count - half)};
  };
  if (!b) {
    const auto [first, second] = halves(a);
    search(first, nullptr, told);
    search(second, nullptr, told);
    search(first, &second, told);
  } else if (a.count >= b->count) {
    const auto [first, second] = halves(a);
    search(first, b, told);
    search(second, b, told);
  } else {
    const auto [first, second] = halves(*b);
    search(a, &first, told);
    search(a, &second, told);
  }
}

}  // namespace throng::stream
