// throng-paper pairs: one variant on one set of boxes.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "apps/common/numbers.hpp"
#include "apps/common/print.hpp"
#include "apps/paper/commands.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/grid.hpp"
#include "apps/paper/input.hpp"
#include "apps/paper/pairs_report.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/output_file.hpp"

namespace throng::paper {
namespace {

const char* help_text =
    R"(Boxes come from FILE.npy, float32 of shape (n, 6) or (frames, n, 6), or from a scene. Each frame is a
step: once cold, then --repeat times warmed; times are medians, summed over the frames. A grid is
shaped once, for --environment or around the first frame. 'total' ends when the output is on the host, in its
form; 'decode' is the host's conversion of a matrix to a list.

Examples:
  throng-paper pairs --scene uniform --objects 10K
  throng-paper pairs boxes.npy --mapping lazy --output byte --repeat 5
  throng-paper pairs boxes.npy --root lomont --steps 2 --no-repair --check
  throng-paper pairs --scene column --objects 100K --frames 5 --grid 8 --json)";

struct Arguments {
  std::string file, scene, objects = "10K", memory = "4G", output;
  std::size_t frames = 1;
  std::uint64_t seed = 1;
  Variant variant;
  double grid = 0;
  std::vector<float> environment;
  DeviceKind device = DeviceKind::cpu;
  unsigned threads = 1;
  int repeat = 1;
  bool check = false, json = false;
  CLI::Option *grid_option = nullptr, *output_option = nullptr, *write_option = nullptr,
              *steps_option = nullptr, *root_option = nullptr, *repair_option = nullptr,
              *radicand_option = nullptr, *environment_option = nullptr;
};

bool is_fast(RootKind root) { return root == RootKind::carmack || root == RootKind::lomont; }

// Incompatible options are reported before anything runs.
void refuse_conflicts(const Arguments& a) {
  const Variant& v = a.variant;
  if (a.file.empty() == a.scene.empty()) {
    throw Failure(a.file.empty() ? "found no boxes, wanted FILE.npy or --scene NAME --objects N"
                                 : "found both a file and --scene, wanted one of them");
  }
  const bool formula = v.mapping == MappingKind::formula;
  if (!formula &&
      a.root_option->count() + a.repair_option->count() + a.radicand_option->count() > 0) {
    throw Failure(
        fmt::format("--mapping {} has no square root: --root, --repair and --radicand go "
                    "with --mapping formula",
                    name(v.mapping)));
  }
  if (a.steps_option->count() > 0 && (!formula || !is_fast(v.root))) {
    throw Failure("--steps goes with --root carmack or lomont, the only ones that take steps");
  }
  if (a.grid_option->count() > 0) {
    const std::vector<float>& e = a.environment;
    if (!e.empty() &&
        !(e[0] <= e[3] && e[1] <= e[4] && e[2] <= e[5] &&
          std::all_of(e.begin(), e.end(), [](float x) { return std::isfinite(x); }))) {
      throw Failure(
          fmt::format("--environment: found {}, wanted a finite lower and upper corner, "
                      "such as 0 0 0 10 10 10",
                      fmt::join(e, " ")));
    }
    if (!(a.grid > 0) || a.grid > 1e18) {
      throw Failure(
          fmt::format("--grid: found {}, wanted more than 0 objects per cell, e.g. 8", a.grid));
    }
    if (a.output_option->count() + a.write_option->count() > 0) {
      throw Failure("--grid gives a list of pairs: leave --output and --write out, or --grid");
    }
  } else if (a.environment_option->count() > 0) {
    throw Failure("--environment is for the grid: give --grid X, too");
  } else if (a.write_option->count() > 0 && v.output != Output::bit) {
    throw Failure(
        fmt::format("--write applies to bits, and --output is {}; leave one out", name(v.output)));
  }
}

// Compares with the exact brute force on the host, as sorted lists with repetitions.
void compare(const Job& job, const Box* boxes, std::vector<Pair> found, Outcome& outcome) {
  Job plain = job;
  plain.variant = {};
  plain.variant.mapping = MappingKind::fold;
  plain.variant.output = Output::pairs;
  std::vector<Pair> truth = make_host_stepper(plain)->step(boxes).pairs;
  std::sort(truth.begin(), truth.end());
  std::sort(found.begin(), found.end());
  std::vector<Pair> difference;
  std::set_difference(truth.begin(), truth.end(), found.begin(), found.end(),
                      std::back_inserter(difference));
  outcome.missing += difference.size();
  difference.clear();
  std::set_difference(found.begin(), found.end(), truth.begin(), truth.end(),
                      std::back_inserter(difference));
  outcome.extra += difference.size();
}

int run(Arguments a) {
  refuse_conflicts(a);
  scenes::check_outputs({{"-o", a.output}}, {{"FILE", a.file}});
  if (a.grid_option->count() > 0) a.variant.per_cell = a.grid;
  const std::uint64_t memory_bytes = common::parse_bytes(a.memory, "--memory");
  const std::uint64_t objects = common::parse_count(a.objects, "--objects");
  if (a.file.empty() && objects > memory_bytes / sizeof(Box) / a.frames) {
    throw Failure(
        fmt::format("--objects {}: boxes of {} bytes, {} frames of them, are more than the {} "
                    "bytes allowed; make fewer, or allow more by --memory",
                    a.objects, sizeof(Box), a.frames, memory_bytes));
  }
  const Boxes boxes =
      a.file.empty() ? make_scene(a.scene, objects, a.frames, a.seed) : read_file(a.file);
  Job job;
  job.variant = a.variant;
  job.n = boxes.n;
  job.memory_bytes = memory_bytes;
  job.threads = a.threads;
  const std::vector<float>& e = a.environment;
  if (!e.empty()) {
    job.environment = {{e[0], e[1], e[2]}, {e[3], e[4], e[5]}};
  } else if (boxes.frames > 0) {
    job.environment = environment_of(boxes.frame(0), boxes.n);
  }
  const std::unique_ptr<Stepper> stepper = make_stepper_on(a.device, job);
  Outcome outcome;
  if (a.variant.per_cell == 0) outcome.errors = count_errors(a.variant, boxes.n, 1);
  std::vector<Pair> all;
  for (std::size_t f = 0; f < boxes.frames; ++f) {
    const Measured m = measure(*stepper, boxes.frame(f), a.repeat);
    outcome.pairs += m.step.pairs.size();
    outcome.checksum += m.checksum;
    outcome.output_bytes += m.step.output_bytes;
    outcome.cells = m.step.cells;
    outcome.entries += m.step.entries;
    Times& t = outcome.times;
    t.upload += m.step.times.upload;
    t.boxes += m.step.times.boxes;
    t.grid += m.step.times.grid;
    t.search += m.step.times.search;
    t.download += m.step.times.download;
    t.decode += m.step.times.decode;
    if (!a.output.empty()) all.insert(all.end(), m.step.pairs.begin(), m.step.pairs.end());
    if (a.check) compare(job, boxes.frame(f), m.step.pairs, outcome);
  }
  if (!a.output.empty()) scenes::write_pairs(a.output, all.data(), all.size());
  const Report report{a.variant, a.device, a.repeat, a.check};
  common::print(a.json ? to_json(report, boxes, outcome) : to_text(report, boxes, outcome));
  return outcome.missing + outcome.extra > 0 ? exit_differs : exit_done;
}

// A choice by name, in the order of the enumeration.
template <class Kind, std::size_t count>
CLI::Option* add_choice(CLI::App& app, const char* option, Kind& value,
                        const char* const (&names)[count], const char* what) {
  std::map<std::string, Kind> choices;
  std::string type;
  for (std::size_t i = 0; i < count; ++i) {
    choices[names[i]] = static_cast<Kind>(i);
    type += (i == 0 ? "" : "|") + std::string(names[i]);
  }
  return app.add_option(option, value, what)
      ->transform(CLI::CheckedTransformer(choices).description(""))
      ->type_name(type);
}

}  // namespace

Run add_pairs(CLI::App& program) {
  static constexpr const char* radicand_names[] = {"integer", "real"};
  static constexpr const char* device_names[] = {"cpu", "cuda"};
  auto a = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("pairs", "Find the pairs by one variant of the system");
  app.footer(help_text);
  app.add_option("FILE", a->file, "boxes")->type_name("FILE.npy");
  app.add_option("--scene", a->scene, "generate the boxes; throng-paper --list names the scenes")
      ->type_name("NAME");
  app.add_option("--objects", a->objects, "number of boxes of the scene (10K)")->type_name("N");
  app.add_option("--frames", a->frames, "number of frames of the scene (1)")
      ->check(CLI::Range(1, 100000).description(""))
      ->type_name("F");
  app.add_option("--seed", a->seed, "seed of the scene (1)")->type_name("S");
  Variant& v = a->variant;
  add_choice(app, "--mapping", v.mapping, mapping_names, "mapping from thread to pair (formula)");
  a->root_option = add_choice(app, "--root", v.root, root_names, "square root (float32)");
  a->steps_option = app.add_option("--steps", v.steps, "Newton steps of a fast root, 1 to 4 (2)")
                        ->check(CLI::Range(min_steps, max_steps).description(""))
                        ->type_name("1..4");
  a->repair_option = app.add_flag("--repair,!--no-repair", v.repair, "the paper's repairs (on)");
  a->radicand_option =
      add_choice(app, "--radicand", v.radicand, radicand_names, "how it is computed (integer)");
  a->output_option = add_choice(app, "--output", v.output, output_names, "form of output (bit)");
  a->write_option =
      add_choice(app, "--write", v.write, write_names, "how bits are written (ballot)");
  a->grid_option =
      app.add_option("--grid", a->grid, "use the grid, with X objects per cell")->type_name("X");
  a->environment_option =
      app.add_option(
             "--environment", a->environment,
             "lower and upper corner of what the grid covers (the first frame's boxes); boxes "
             "outside go to the cells at its border")
          ->expected(6)
          ->type_name("X Y Z X Y Z");
  add_choice(app, "--device", a->device, device_names, "where to run (cpu)");
  app.add_option("--threads", a->threads, "threads of the cpu (1)")
      ->check(CLI::Range(1, 1024).description(""))
      ->type_name("N");
  app.add_option("--repeat", a->repeat, "number of warmed runs for the median (1)")
      ->check(CLI::Range(1, 1000000).description(""))
      ->type_name("K");
  app.add_option("--memory", a->memory, "maximum memory of the output, a list or the grid (4G)")
      ->type_name("BYTES");
  app.add_option("-o,--pairs-file", a->output, "write the pairs of all frames")
      ->type_name("PAIRS.npy");
  app.add_flag("--check", a->check, "compare with the exact brute force; status 1 if they differ");
  app.add_flag("--json", a->json, "print one JSON object");
  return [a] { return run(*a); };
}

}  // namespace throng::paper
