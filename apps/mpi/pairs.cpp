// throng-mpi pairs: finds the pairs of one file of boxes; each rank reads a slice.
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <throng/checksum.hpp>
#include <throng/mpi.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/median.hpp"
#include "apps/common/numbers.hpp"
#include "apps/mpi/collective.hpp"
#include "apps/mpi/commands.hpp"
#include "apps/mpi/file.hpp"
#include "apps/mpi/search.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/npy.hpp"

namespace throng::mpi_app {
namespace {

struct Arguments {
  std::string input, output, group, mask, owner, world, is_static;
  std::string order = "any", nan = "refuse";
  BackendOptions backend_options;
  float margin = 0;
  unsigned threads = 0;
  std::size_t repeat = 1;
  double seconds = 600;
  bool json = false;
};

struct Values {
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;
};

template <class T>
Strided<T> strided(const std::vector<T>& values, const std::string& path) {
  return path.empty() ? Strided<T>{} : Strided<T>{values.data(), values.size()};
}

// An empty filter array is still present if a file was given; null would mean absent.
Filters filters_of(const Values& v, const Arguments& a) {
  return {strided(v.group, a.group), strided(v.mask, a.mask), strided(v.owner, a.owner),
          strided(v.world, a.world), strided(v.is_static, a.is_static)};
}

Values read_filters(const Arguments& a, std::uint64_t count, MPI_Comm comm) {
  Values values;
  run_collectively(comm, [&] {
    const auto load = [&](const std::string& path, auto& out, auto* read) {
      if (!path.empty()) out = slice(read(path, count), rank_of(comm), size_of(comm));
    };
    load(a.group, values.group, &scenes::read_u32);
    load(a.mask, values.mask, &scenes::read_u32);
    load(a.owner, values.owner, &scenes::read_i32);
    load(a.world, values.world, &scenes::read_i32);
    load(a.is_static, values.is_static, &scenes::read_u8);
  });
  return values;
}

std::uint64_t checksum_of(const mpi::Pairs64& pairs, std::uint64_t count) {
  std::uint64_t sum = 0;
  for (const Pair64& pair : pairs) {
    // Equals the checksum of a single process while ids fit in 32 bits.
    sum += count <= max_box_count ? mix64(pair.first << 32 | pair.second)
                                  : mix64(mix64(pair.first) ^ pair.second);
  }
  return sum;
}

mpi::Settings settings_of(const Arguments& a) {
  mpi::Settings settings;
  settings.search.margin = a.margin;
  settings.search.threads = a.threads;
  settings.search.order = a.order == "canonical" ? Order::canonical : Order::any;
  settings.search.nan = a.nan == "inactive" ? NanPolicy::inactive : NanPolicy::refuse;
  settings.timeout_seconds = a.seconds;
  return settings;
}

void run(const Arguments& a) {
  MPI_Comm comm = MPI_COMM_WORLD;
  if (!(a.seconds >= 0)) {
    throw common::Failure(
        fmt::format("--seconds: found {}, wanted 0 (no limit) or more", a.seconds));
  }
  check_output({"-o", a.output},
               {{"FILE", a.input},
                {"--group", a.group},
                {"--mask", a.mask},
                {"--owner", a.owner},
                {"--world", a.world},
                {"--static", a.is_static}},
               comm);
  const BoxSlices file(a.input, comm);
  if (file.frames() == 0) {
    throw common::Failure(fmt::format("{}: found no frame of {} boxes, wanted at least one frame",
                                      a.input, file.count()));
  }
  const Values values = read_filters(a, file.count(), comm);
  Search search(comm, a.backend_options, settings_of(a));
  std::uint64_t found = 0, checksum = 0, inactive = 0, comparisons = 0, visited = 0;
  std::uint64_t bytes = 0, messages = 0, owned_and_ghost = 0;
  std::vector<Pair64> kept;
  std::vector<double> times(a.repeat);
  for (std::uint64_t f = 0; f < file.frames(); ++f) {
    const std::vector<Box> boxes = file.read(f);
    mpi::RankBoxes mine{Boxes(boxes), nullptr};
    mine.boxes.filters = filters_of(values, a);
    run_collectively(comm, [&] { search.load(mine); });
    for (std::size_t k = 0; k < a.repeat; ++k) {
      MPI_Barrier(comm);
      const auto start = std::chrono::steady_clock::now();
      const Result r = search.find();
      times[k] +=
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
              .count();
      require_ok(r, a.input, {.nan = true, .backend = true});
      if (k != 0) continue;
      found += r.found;
      inactive += r.inactive;
      comparisons += r.comparisons;
      visited += r.visited;
      mpi::Pairs64 pairs;
      run_collectively(comm, [&] { pairs = search.pairs(); });
      checksum += sum_over_ranks(checksum_of(pairs, file.count()), comm);
      if (!a.output.empty()) {
        run_collectively(comm, [&] { kept.insert(kept.end(), pairs.begin(), pairs.end()); });
      }
      bytes += max_over_ranks(search.traffic().halo.bytes, comm);
      messages += max_over_ranks(search.traffic().halo.messages, comm);
      owned_and_ghost += sum_over_ranks(search.traffic().owned_and_ghost, comm);
    }
  }
  if (!a.output.empty()) write_pairs(a.output, kept, comm);
  const double total_ms = common::median(times);
  const double imbalance = search.traffic().imbalance;
  const std::string buffers = search.buffers();
  std::string text;
  if (a.json) {
    nlohmann::ordered_json json = {{"n", file.count()},
                                   {"pairs", found},
                                   {"checksum", fmt::format("{:016x}", checksum)},
                                   {"inactive", inactive},
                                   {"ranks", size_of(comm)},
                                   {"total_ms", total_ms},
                                   {"comparisons", comparisons},
                                   {"visited", visited},
                                   {"imbalance", imbalance},
                                   {"boxes_searched", owned_and_ghost},
                                   {"most_bytes_a_rank", bytes},
                                   {"most_messages_a_rank", messages}};
    if (!buffers.empty()) json["device_memory_to_mpi"] = buffers;
    text = json.dump(2) + "\n";
  } else {
    text = fmt::format(
        "{}: {} boxes on {} ranks\npairs     {}\nchecksum  {:016x}\ninactive  {}\n"
        "time      {} ms (median of {}, the first includes partitioning)\n"
        "compared  {} candidates, the largest rank's work {:.2f} x the mean\n"
        "sent      at most {} in {} messages per rank\n",
        a.input, report::format_count(file.count()), size_of(comm), report::format_count(found),
        checksum, report::format_count(inactive), report::format_ms(total_ms), a.repeat,
        report::format_count(comparisons), imbalance,
        report::format_bytes(static_cast<double>(bytes)), report::format_count(messages));
    if (!buffers.empty()) text += fmt::format("device memory is passed to MPI {}\n", buffers);
    if (!a.output.empty()) text += fmt::format("pairs written to {}\n", a.output);
  }
  say(text, comm);
}

const char* help_text =
    R"(Each rank reads its slice of the file. Pairs are indices of boxes in the file;
the checksum is that of 'throng pairs'. -o writes uint64 of shape (pairs, 2), ordered by rank.

Examples:
  mpirun -n 4 throng pairs --mpi boxes.npy
  mpirun -n 4 throng pairs --mpi boxes.npy --world worlds.npy -o pairs.npy --json
  mpirun -n 2 throng pairs --mpi boxes.npy --on-device        one GPU per rank
Exit status: 0 success, 2 bad input or an output that cannot be written.)";

}  // namespace

Run add_pairs(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("pairs", "Find the overlapping pairs of a file of boxes");
  app.footer(help_text);
  app.add_option("boxes", a->input, "float32 of shape (n, 6) or (frames, n, 6)")
      ->required()
      ->type_name("BOXES.npy");
  app.add_option("-o,--output", a->output, "write the pairs")->type_name("PAIRS.npy");
  const auto filter = [&](const char* name, std::string& path) {
    app.add_option(name, path, "one value per box")->type_name("FILE.npy");
  };
  filter("--group", a->group);
  filter("--mask", a->mask);
  filter("--owner", a->owner);
  filter("--world", a->world);
  filter("--static", a->is_static);
  app.add_option_function<std::string>("--margin", common::margin_into(a->margin),
                                       "expand boxes by M on every side")
      ->type_name("M");
  app.add_option("--nan", a->nan, "refuse or inactive (refuse)")
      ->check(CLI::IsMember({"refuse", "inactive"}))
      ->type_name("HOW");
  app.add_option("--order", a->order, "any or canonical (sorted on each rank) (any)")
      ->check(CLI::IsMember({"any", "canonical"}))
      ->type_name("ORDER");
  a->backend_options.add_to(app);
  app.add_option_function<std::string>("--threads", common::threads_into(a->threads),
                                       "maximum per rank; 0: all")
      ->type_name("N");
  app.add_option_function<std::string>("--repeat",
                                       common::count_into(a->repeat, "--repeat", 1, 1000000),
                                       "searches per frame to take the median of (1)")
      ->type_name("K");
  app.add_option("--seconds", a->seconds, "how long to wait for a rank; 0: no limit (600)")
      ->type_name("S");
  app.add_flag("--json", a->json, "print one JSON object");
  return [a] { run(*a); };
}

}  // namespace throng::mpi_app
