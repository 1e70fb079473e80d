#include "apps/stream/stream.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include <throng/finder.hpp>

#include "apps/common/failure.hpp"
#include "apps/stream/pair_output.hpp"
#include "apps/stream/solver.hpp"
#include "apps/stream/source.hpp"

namespace throng::stream {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr std::size_t kib = 1024, mib = 1024 * 1024;
// In addition to rows, pairs and the library: file buffers, source blocks, extent lists.
constexpr std::size_t fixed_bytes = mib;
constexpr std::size_t min_arena_bytes = 128 * kib;
constexpr std::size_t min_run_bytes = 64 * kib;
// The library's memory per box in a search, without pairs: 19 to 55 measured (a million boxes,
// clusters to rods, two threads), and 60 more where worlds or static boxes are partitioned. Where
// it is more, the search fails and is repeated in halves.
constexpr std::size_t search_bytes = 64, partition_bytes = 64;
// Maximum slabs per cut, and the size below which a cut does not pay.
constexpr std::uint64_t target_slabs = 40, min_slab_rows = 500000;
// The fixed part of a thread's workspace, with a reserve.
constexpr std::size_t thread_bytes = 4 * mib;

std::size_t search_bytes_of(const Layout& layout) {
  return search_bytes + (layout.world || layout.is_static ? partition_bytes : 0);
}

// The smallest cap under which the library searches a few boxes; a cap of one byte reports it.
std::size_t min_finder_bytes(Options options) {
  constexpr std::size_t boxes = 256;
  const Box one{};
  options.memory_cap_bytes = 1;
  Finder finder(options);
  const Result r =
      finder.consume(Boxes(&one, boxes, 0), [](const Pair*, std::size_t) { return true; });
  return static_cast<std::size_t>(r.bytes_needed);
}

struct Sizes {
  SolverSizes solver;
  std::size_t run_keys = 0, extent_bytes = 0;
  std::size_t memory_bytes = 0;  // of the scratch
  unsigned threads = 0;
};

Sizes divide_memory(const Request& request, const std::string& name, std::size_t row_bytes,
                    std::size_t search_bytes_per_row, std::uint64_t rows) {
  const std::size_t cap = request.options.memory_cap_bytes;
  const bool sorts = request.options.order == Order::canonical && !request.output.empty();
  Options one_thread = request.options;
  one_thread.threads = 1;
  const std::size_t finder = min_finder_bytes(one_thread);
  const std::size_t least =
      fixed_bytes + finder + min_arena_bytes + (sorts ? 2 * min_run_bytes : 0);
  if (cap < least) {
    throw common::Failure(
        fmt::format("{}: --memory: found {} bytes, wanted at least {} bytes", name, cap, least));
  }
  Sizes sizes;
  const std::size_t run = sorts ? min_run_bytes + (cap - least) / 8 : 0;
  sizes.run_keys = run / sizeof(std::uint64_t);
  const std::size_t rest = cap - fixed_bytes - run;
  const std::size_t spare = rest - finder - min_arena_bytes;
  // No larger than one cut needs: smaller searches use the caches better, and the rest of the cap
  // replaces disk space.
  const std::size_t bytes_per_row = row_bytes + search_bytes_per_row;
  const std::size_t arena_rows = static_cast<std::size_t>(
      std::min<std::uint64_t>(spare / bytes_per_row, rows / target_slabs + min_slab_rows));
  const std::size_t arena_bytes = min_arena_bytes + arena_rows * row_bytes;
  sizes.extent_bytes =
      std::clamp<std::size_t>(arena_bytes / 128 / (4 * kib) * (4 * kib), 4 * kib, mib);
  if (sorts) sizes.solver.finder_bytes = sizes.extent_bytes;
  sizes.solver.arena_bytes = arena_bytes;
  // Reserves 1.5 times a search's memory in addition to the rows.
  const std::size_t search = finder + arena_rows * search_bytes_per_row * 3 / 2 + 8 * thread_bytes;
  const std::size_t left = rest - arena_bytes - sizes.solver.finder_bytes;
  sizes.memory_bytes = left > search ? left - search : 0;
  sizes.solver.finder_bytes = left - sizes.memory_bytes;
  sizes.solver.sample_rows = std::clamp<std::size_t>(cap / (2 * kib), 512, 32 * kib);
  const unsigned most = request.options.threads;
  const auto affordable_threads = static_cast<unsigned>(
      std::clamp<std::size_t>(sizes.solver.finder_bytes / thread_bytes, 1, 256));
  // 0 leaves the number to the executor; reduced only where a small cap requires it.
  const unsigned there = std::max(1u, std::thread::hardware_concurrency());
  sizes.threads = affordable_threads < (most ? most : there) ? affordable_threads : most;
  return sizes;
}

}  // namespace

std::uint64_t bytes_in_memory(const Request& request) {
  const auto of = [&](const SetFiles& files) -> std::uint64_t {
    if (files.boxes.empty()) return 0;
    const FileSource source(files, request.round_outward);
    const Layout& layout = source.layout();
    return source.count() *
           (source.frames() * sizeof(Box) + layout.bytes - sizeof(Box) + search_bytes_of(layout));
  };
  return of(request.a) + of(request.b) + thread_bytes;
}

Report run(const Request& request) {
  FileSource a(request.a, request.round_outward);
  std::optional<FileSource> b;
  std::string name = a.path();
  std::size_t frames = a.frames(), row_bytes = a.layout().bytes;
  std::size_t search_bytes_per_row = search_bytes_of(a.layout());
  if (!request.b.boxes.empty()) {
    b.emplace(request.b, request.round_outward);
    check_frames(a.path(), a.frames(), b->path(), b->frames());
    name += " and " + b->path();
    frames = std::max(frames, b->frames());
    row_bytes = std::max(row_bytes, b->layout().bytes);
    search_bytes_per_row = std::max(search_bytes_per_row, search_bytes_of(b->layout()));
  }
  const Sizes sizes = divide_memory(request, name, row_bytes, search_bytes_per_row,
                                    a.count() + (b ? b->count() : 0));
  Options options = request.options;
  options.threads = sizes.threads;
  Scratch scratch(request.scratch_folder, sizes.extent_bytes, sizes.memory_bytes);
  PairOutput output(request.output, sizes.run_keys, scratch);
  std::size_t frame = 0;
  Solver solver(sizes.solver, options, scratch, output, [&](double share) {
    if (request.progress) {
      request.progress((static_cast<double>(frame) + share) / static_cast<double>(frames));
    }
  });

  Report report;
  report.count = a.count();
  if (b) report.count_b = b->count();
  const auto start = Clock::now();
  for (; frame < frames; ++frame) {
    const auto frame_start = Clock::now();
    a.set_frame(a.frames() == 1 ? 0 : frame);
    Solver::Problem problem;
    problem.side[0] = &a;
    problem.layout[0] = &a.layout();
    problem.self = !b;
    if (b) {
      b->set_frame(b->frames() == 1 ? 0 : frame);
      problem.side[1] = &*b;
      problem.layout[1] = &b->layout();
    }
    problem.name = frames > 1 ? fmt::format("{}, frame {}", name, frame) : name;
    const Solver::InputCounts seen = solver.solve_frame(problem);
    const PairTotals totals = output.finish_frame();
    report.frames.push_back({totals.count, totals.checksum, seen.inactive, seen.comparisons,
                             seen.visited, ms_since(frame_start)});
  }
  output.finish();
  report.plan = solver.plan();
  report.searches = solver.searches();
  report.slabs = solver.slabs();
  report.scratch_bytes = scratch.file_bytes();
  report.order_ms = output.order_ms();
  report.search_ms = solver.search_ms();
  report.read_ms = std::max(0.0, ms_since(start) - report.search_ms - report.order_ms);
  return report;
}

}  // namespace throng::stream
