// throng-bench-frames: one rival through the frames of a scene, its objects kept from frame to
// frame, and a line of each frame as soon as it is done: whoever reads need not wait for the slow
// ones.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "bench/rivals.hpp"
#include "program/failure.hpp"
#include "program/numbers.hpp"
#include "scene/scene.hpp"

namespace throng::bench {
namespace {

using program::Failure;

struct Arguments {
  scene::Spec spec;
  std::string rival, objects = "10K";
  std::size_t first = 0, frames = 8;
  unsigned threads = 1;
  bool list = false;
};

// A line that is read at once, or an end: nobody wants the rest.
void say(const std::string& line) {
  if (std::fputs((line + "\n").c_str(), stdout) < 0 || std::fflush(stdout) != 0) {
    throw Failure("standard output cannot be written");
  }
}

Entry find_rival(const std::string& name) {
  std::string known;
  for (Entry& e : rival_entries()) {
    if (e.name == name) return std::move(e);
    known += (known.empty() ? "" : "; ") + e.name;
  }
  if (name.empty()) throw Failure("--rival: found none, wanted one of: " + known);
  throw Failure(fmt::format("--rival: found '{}', wanted one of: {}", name, known));
}

double ms_of(Contender& contender, const Input& in) {
  const auto start = std::chrono::steady_clock::now();
  contender.run(in);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

scene::Scene make_scene(Arguments& a) {
  const std::uint64_t objects = program::parse_count(a.objects, "--objects");
  if (objects < 1 || objects > max_box_count) {
    throw Failure(fmt::format("--objects: found {}, wanted 1 to {}", objects, max_box_count));
  }
  a.spec.objects = static_cast<std::size_t>(objects);
  a.spec.frames = a.first + a.frames + 1;
  scene::Scene made(a.spec);
  if (made.has_worlds()) {
    throw Failure(
        fmt::format("--scene: found '{}', wanted a scene of one world, as rivals know "
                    "no other",
                    a.spec.name));
  }
  return made;
}

int run(Arguments& a) {
  if (a.list) {
    for (const Entry& e : rival_entries()) say(e.name);
    return program::exit_done;
  }
  const Entry rival = find_rival(a.rival);
  const scene::Scene scene = make_scene(a);
  std::vector<Box> boxes(scene.size());
  const Input in{boxes.data(), boxes.size(), nullptr};
  scene.frame(a.first, boxes.data());
  say("frame,ms,pairs");
  const auto start = std::chrono::steady_clock::now();
  const auto contender = rival.make(a.threads);
  contender->prepare(in);
  const std::chrono::duration<double, std::milli> prepared =
      std::chrono::steady_clock::now() - start;
  contender->place(in);
  say(fmt::format("insert,{:.4f},0", prepared.count() + ms_of(*contender, in)));
  std::vector<Pair> pairs;
  for (std::size_t f = a.first + 1; f <= a.first + a.frames; ++f) {
    scene.frame(f, boxes.data());
    contender->place(in);
    const double ms = ms_of(*contender, in);
    pairs.clear();
    contender->collect(in, pairs);
    say(fmt::format("{},{:.4f},{}", f, ms, pairs.size()));
  }
  return program::exit_done;
}

int guarded(int argc, char** argv) {
  CLI::App app{
      "One rival of the benchmark through the frames of a scene.\n\n"
      "Examples:\n"
      "  throng-bench-frames --list\n"
      "  throng-bench-frames --rival 'Bullet btDbvt, default' --scene column --objects 100K \\\n"
      "      --moving 0.25 --first 49 --frames 6\n"
      "Prints CSV, each line at once: 'insert' with the ms that it took to put the boxes of the\n"
      "first frame in and to run once; then of each of the frames after it the number, the ms of\n"
      "the run from moved boxes to pairs, and how many pairs there are.\n"
      "Exit status: 0 done, 2 bad usage.",
      "throng-bench-frames"};
  Arguments a;
  a.spec.name = "uniform";
  app.add_flag("--list", a.list, "The names of the rivals that are here, one a line");
  app.add_option("--rival", a.rival, "One of these names");
  app.add_option("--scene", a.spec.name, "A scene by name (uniform)");
  app.add_option("--objects", a.objects, "Boxes, such as 1000, 100K or 2.5M (10K)");
  app.add_option("--density", a.spec.density, "Expected pairs a box; what the scene has of itself");
  app.add_option("--moving", a.spec.moving, "Share of the boxes that move, 0 to 1 (1)");
  app.add_option("--seed", a.spec.seed, "Another number, another scene (1)");
  app.add_option("--first", a.first, "The frame that is put in, outside the frames' times (0)")
      ->check(CLI::Range(std::size_t{0}, std::size_t{1} << 24));
  app.add_option("--frames", a.frames, "How many frames after that one (8)")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1} << 24));
  app.add_option("--threads", a.threads, "For rivals that take more than one (1)")
      ->check(CLI::Range(1, 1024));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? program::exit_done : program::exit_bad;
  }
  std::string message = "out of memory";
  try {
    return run(a);
  } catch (const std::bad_alloc&) {
    // No room for more than the plain words.
  } catch (const std::length_error&) {
    // A vector that no memory could hold.
  } catch (const std::exception& error) {
    message = error.what();
  }
  std::fputs(("throng-bench-frames: " + message + "\n").c_str(), stderr);
  return program::exit_bad;
}

}  // namespace
}  // namespace throng::bench

int main(int argc, char** argv) { return throng::bench::guarded(argc, argv); }
