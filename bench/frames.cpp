// Subcommand frames: one method through the frames of a scene, its objects kept from frame to
// frame. It prints a line as soon as a frame is done, so that a reader can stop a slow method.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/numbers.hpp"
#include "apps/common/print.hpp"
#include "apps/scenes/scene.hpp"
#include "bench/competitors/competitors.hpp"
#include "bench/subcommands.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

using common::Failure;

struct Arguments {
  scenes::Spec spec;
  std::string library, objects = "10K";
  std::size_t first = 0, frames = 8;
  unsigned threads = 1;
  bool list = false;
};

void print_line(const std::string& line) { common::print(line + "\n"); }

MethodInfo find_method(const std::string& name) {
  std::string known;
  for (MethodInfo& m : competitor_methods()) {
    if (m.name == name) return std::move(m);
    known += (known.empty() ? "" : "; ") + m.name;
  }
  if (name.empty()) throw Failure("--library: found none, wanted one of: " + known);
  throw Failure(fmt::format("--library: found '{}', wanted one of: {}", name, known));
}

scenes::Scene make_scene(Arguments& a) {
  const std::uint64_t objects = common::parse_count(a.objects, "--objects");
  if (objects < 1 || objects > max_box_count) {
    throw Failure(fmt::format("--objects: found {}, wanted 1 to {}", objects, max_box_count));
  }
  a.spec.objects = static_cast<std::size_t>(objects);
  a.spec.frames = a.first + a.frames + 1;
  scenes::Scene made(a.spec);
  if (made.has_worlds()) {
    throw Failure(
        fmt::format("--scene: found '{}', wanted a scene of one world: other libraries "
                    "support no more",
                    a.spec.name));
  }
  return made;
}

int run(Arguments& a) {
  if (a.list) {
    for (const MethodInfo& m : competitor_methods()) print_line(m.name);
    return common::exit_done;
  }
  const MethodInfo info = find_method(a.library);
  const scenes::Scene scene = make_scene(a);
  std::vector<Box> boxes(scene.size());
  const Input in{boxes.data(), boxes.size(), nullptr};
  scene.frame(a.first, boxes.data());
  print_line("frame,ms,pairs");
  std::unique_ptr<Method> method;
  const double prepare_ms = time_ms([&] {
    method = info.make(a.threads);
    method->prepare(in);
  });
  method->place(in);
  print_line(fmt::format("insert,{:.4f},0", prepare_ms + time_ms([&] { method->run(in); })));
  std::vector<Pair> pairs;
  for (std::size_t f = a.first + 1; f <= a.first + a.frames; ++f) {
    scene.frame(f, boxes.data());
    method->place(in);
    const double ms = time_ms([&] { method->run(in); });
    pairs.clear();
    method->collect(in, pairs);
    print_line(fmt::format("{},{:.4f},{}", f, ms, pairs.size()));
  }
  return common::exit_done;
}

}  // namespace

int frames_command(int argc, char** argv) {
  CLI::App app{
      "One method of the benchmark through the frames of a scene.\n\n"
      "Examples:\n"
      "  throng-bench frames --list\n"
      "  throng-bench frames --library 'Bullet btDbvt, default' --scene column --objects 100K \\\n"
      "      --moving 0.25 --first 49 --frames 6\n"
      "Prints CSV, one line at a time: 'insert' with the ms to add the boxes of the first frame "
      "and\n"
      "to run once; then, for each later frame, its number, the ms from moved boxes to pairs, and\n"
      "the number of pairs.\n"
      "Exit status: 0 done, 2 bad usage.",
      "throng-bench frames"};
  Arguments a;
  a.spec.name = "uniform";
  app.add_flag("--list", a.list, "Print the names of the methods that are built, one per line");
  app.add_option("--library", a.library, "One of these names");
  app.add_option("--scene", a.spec.name, "A scene by name (uniform)");
  app.add_option("--objects", a.objects, "Boxes, such as 1000, 100K or 2.5M (10K)");
  app.add_option("--density", a.spec.density, "Expected pairs per box; default: the scene's own");
  app.add_option("--moving", a.spec.moving, "Share of the boxes that move, 0 to 1 (1)");
  app.add_option("--seed", a.spec.seed, "Another number, another scene (1)");
  app.add_option("--first", a.first, "The frame that is inserted, not timed as a frame (0)")
      ->check(CLI::Range(std::size_t{0}, std::size_t{1} << 24));
  app.add_option("--frames", a.frames, "How many frames after that one (8)")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1} << 24));
  app.add_option("--threads", a.threads, "For methods that use more than one (1)")
      ->check(CLI::Range(1, 1024));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? common::exit_done : common::exit_bad;
  }
  return run(a);
}

}  // namespace throng::bench
