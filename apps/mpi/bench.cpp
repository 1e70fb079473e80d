// throng-mpi bench: strong and weak scaling, in counted work and in time.
#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/median.hpp"
#include "apps/common/numbers.hpp"
#include "apps/mpi/collective.hpp"
#include "apps/mpi/commands.hpp"
#include "apps/mpi/file.hpp"
#include "apps/mpi/search.hpp"
#include "apps/report/format.hpp"
#include "apps/report/table.hpp"
#include "apps/scenes/scene.hpp"
#include "mpi/minimum_copies.hpp"

namespace throng::mpi_app {
namespace {

struct Arguments {
  std::string scene = "uniform", objects = "100K", csv;
  bool weak = false, parts = false;
  std::size_t frames = 5;
  unsigned threads = 1;
  BackendOptions backend_options;
};

// The boxes that this rank holds, with their ids.
struct Slice {
  std::vector<std::uint64_t> ids;
  std::vector<Box> boxes;
};

// The boxes of frame f selected by `mine`. Every rank generates all boxes, so that only measured
// traffic is sent.
template <class Mine>
Slice make(const scenes::Scene& scene, std::size_t f, Mine&& mine) {
  Slice slice;
  std::vector<Box> some(4096);
  for (std::size_t i = 0; i < scene.size(); i += some.size()) {
    const std::size_t end = std::min(scene.size(), i + some.size());
    scene.boxes(f, i, end, some.data());
    for (std::size_t k = i; k < end; ++k) {
      if (!mine(k, some[k - i])) continue;
      slice.ids.push_back(k);
      slice.boxes.push_back(some[k - i]);
    }
  }
  return slice;
}

struct Row {
  int ranks = 0;
  std::uint64_t boxes = 0, pairs = 0, bytes = 0, messages = 0, max_work = 0, work = 0,
                owned_and_ghost = 0;
  std::uint64_t balance_bytes = 0;
  double ms = 0, imbalance = 1;
  std::string buffers;
};

Row measure(const Arguments& a, std::uint64_t objects, MPI_Comm comm) {
  scenes::Spec spec;
  spec.name = a.scene;
  spec.objects = objects;
  spec.frames = a.frames + 4;
  const scenes::Scene scene(spec);
  mpi::Settings settings;
  settings.search.threads = a.threads;
  settings.parts = a.parts;
  Search search(comm, a.backend_options, settings);
  const int rank = rank_of(comm), size = size_of(comm);
  Row row;
  row.ranks = size;
  row.boxes = objects;
  std::vector<double> times;
  const std::uint64_t begin = slice_begin(objects, rank, size);
  const std::uint64_t end = slice_begin(objects, rank + 1, size);
  // The first frames partition and balance; after them each rank holds the boxes that it owns.
  for (std::size_t f = 0; f < a.frames + 4; ++f) {
    const bool first = f == 0;
    const Slice slice = make(scene, f, [&](std::size_t i, const Box& box) {
      return first ? i >= begin && i < end : search.home(box) == rank;
    });
    run_collectively(comm, [&] { search.load({Boxes(slice.boxes), slice.ids.data()}); });
    MPI_Barrier(comm);
    const auto start = std::chrono::steady_clock::now();
    const Result r = search.find();
    const double ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    require_ok(r, a.scene, {.backend = true});
    row.balance_bytes = std::max(row.balance_bytes, search.traffic().balance.bytes);
    if (f < 4) continue;
    times.push_back(ms);
    row.pairs = r.found;
  }
  const mpi::Traffic& t = search.traffic();
  row.bytes = max_over_ranks(t.halo.bytes, comm);
  row.messages = max_over_ranks(t.halo.messages, comm);
  row.balance_bytes = max_over_ranks(row.balance_bytes, comm);
  row.max_work = max_over_ranks(t.work, comm);
  row.work = sum_over_ranks(t.work, comm);
  row.owned_and_ghost = sum_over_ranks(t.owned_and_ghost, comm);
  row.imbalance = t.imbalance;
  row.ms = common::median(times);
  row.buffers = search.buffers();
  return row;
}

void run(const Arguments& a) {
  const std::uint64_t objects = common::parse_count(a.objects, "--objects");
  MPI_Comm world = MPI_COMM_WORLD;
  check_output({"-o", a.csv}, {}, world);
  std::vector<int> counts;
  for (int k = 1; k < size_of(world); k *= 2) counts.push_back(k);
  counts.push_back(size_of(world));
  report::Table table(
      fmt::format("{}: {} boxes{}", a.scene, report::format_count(objects),
                  a.weak ? " per rank (weak scaling)" : " (strong scaling)"),
      {"ranks", "boxes", "pairs", "ms", "work per box", "max work / 1 rank's", "imbalance",
       "copies per box", "copies / minimum", "max sent per rank", "max messages", "for balance"});
  double first_work = 0;
  std::string buffers;
  for (const int k : counts) {
    MPI_Comm some = MPI_COMM_NULL;
    MPI_Comm_split(world, rank_of(world) < k ? 0 : MPI_UNDEFINED, 0, &some);
    Row row;
    run_collectively(world, [&] {
      if (some == MPI_COMM_NULL) return;
      row = measure(a, a.weak ? objects * static_cast<std::uint64_t>(k) : objects, some);
    });
    if (some != MPI_COMM_NULL) MPI_Comm_free(&some);
    if (rank_of(world) != 0) continue;
    buffers = row.buffers;
    const double boxes = static_cast<double>(row.boxes);
    if (k == 1) first_work = static_cast<double>(row.max_work);
    const double copies = static_cast<double>(row.owned_and_ghost) / boxes - 1;
    scenes::Spec spec;
    spec.name = a.scene;
    spec.objects = row.boxes;
    const double least = mpi::minimum_copies(k, scenes::Scene(spec).side());
    table.add_row(
        {fmt::format("{}", k), report::format_count(row.boxes), report::format_count(row.pairs),
         report::format_ms(row.ms), fmt::format("{:.1f}", static_cast<double>(row.work) / boxes),
         fmt::format("{:.4f}", static_cast<double>(row.max_work) / first_work),
         fmt::format("{:.3f}", row.imbalance), fmt::format("{:.4f}", copies),
         a.scene == "uniform" && k > 1 ? fmt::format("{:.2f}", copies / least) : "",
         report::format_bytes(static_cast<double>(row.bytes)), report::format_count(row.messages),
         report::format_bytes(static_cast<double>(row.balance_bytes))});
  }
  table.add_note(
      "Median time of frames in which all boxes move. Work is counted: comparisons, boxes, pairs.");
  if (!buffers.empty()) {
    table.add_note(fmt::format("Boxes and pairs are in device memory, passed to MPI {}.", buffers));
  }
  say(table.text(), world);
  run_collectively(world, [&] {
    if (a.csv.empty() || rank_of(world) != 0) return;
    std::ofstream file(a.csv, std::ios::binary);
    file << table.csv();
    if (!file.flush()) throw common::Failure(fmt::format("{}: cannot be written", a.csv));
  });
}

const char* help_text =
    R"(Runs on 1, 2, 4, ... of the ranks, up to all. Strong scaling: a fixed number of boxes; with --weak
that number per rank.

Examples:
  mpirun -n 8 throng bench --mpi --objects 1M
  mpirun -n 64 --oversubscribe throng bench --mpi --weak --objects 2K --scene pile)";

}  // namespace

Run add_bench(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("bench", "Strong and weak scaling");
  app.footer(help_text);
  app.add_option("--scene", a->scene, "a scene of 'throng scene' (uniform)")->type_name("NAME");
  app.add_option("--objects", a->objects, "in total, or with --weak per rank (100K)")
      ->type_name("N");
  app.add_flag("--weak", a->weak, "weak scaling: --objects is the number per rank");
  app.add_flag("--parts", a->parts, "search groups that lie far apart in a region separately");
  app.add_option_function<std::string>("--frames",
                                       common::count_into(a->frames, "--frames", 1, 100000),
                                       "frames to take the median of (5)")
      ->type_name("F");
  a->backend_options.add_to(app);
  app.add_option_function<std::string>("--threads", common::threads_into(a->threads),
                                       "threads per rank (1)")
      ->type_name("N");
  app.add_option("-o,--output", a->csv, "write the table")->type_name("FILE.csv");
  return [a] { run(*a); };
}

}  // namespace throng::mpi_app
