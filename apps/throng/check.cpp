// throng check: compares every backend, algorithm, instruction set, thread count, order and form
// with a double loop.
#include <algorithm>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/finder.hpp>

#include "apps/common/numbers.hpp"
#include "apps/report/format.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/comparison.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/expected_pairs.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/input.hpp"

namespace throng::cli {
namespace {

const char* help_text =
    R"(Compares, pair by pair, the results of every algorithm, for every instruction set of this processor,
several numbers of threads and both orders, with those of a separate double loop. The double loop
tests all pairs: 300,000 boxes take seconds, a million takes minutes. Large inputs run with fewer
thread counts and orders, and with all-pairs only once;
--full tries everything.

Examples:
  throng check boxes.npy
  throng check robots.npy scene.npy --margin 0.01
  throng check worlds.npy --world worlds-world.npy
  throng check recording.npy --frames 10
Exit status: 0 all agree, 1 a result differs, 2 bad input.)";

struct Arguments {
  InputArguments input;
  std::size_t frames = 3;
  bool full = false;
};

// The number of runs on this frame that differ from the double loop.
std::size_t check_frame(const Input& input, const Options& options, std::size_t frame, bool full) {
  const Boxes a = input.a().frame(frame);
  std::optional<Boxes> b;
  if (input.b()) b = input.b()->frame(frame);
  // First, so that boxes which the library refuses are reported at once.
  Finder probe(options);
  const Result result = b ? probe.find(a, *b) : probe.find(a);
  require_ok(result, input, frame, {.nan = true});
  Progress progress("double loop: box", a.size());
  ExpectedPairs expected_pairs(a, b ? &*b : nullptr, options.margin,
                               [&](std::size_t done) { progress.at(done); });
  progress.clear_line();
  print(fmt::format("{}: {} boxes{}, {} pairs, {} inactive by the double loop\n", input.name(frame),
                    report::format_count(a.size()),
                    b ? " and " + report::format_count(b->size()) : "",
                    report::format_count(expected_pairs.pairs().size()),
                    report::format_count(expected_pairs.inactive())));
  Comparison comparison(a, b ? &*b : nullptr, options, expected_pairs);
  print(comparison.head());
  return comparison.run(full, [](const Comparison::Row& row) {
    print(row.text());
    finish_output();  // Flush: a row may take seconds.
  });
}

int run(const Arguments& arguments) {
  const Input input(arguments.input);
  const Options options = to_options(arguments.input, SearchArguments{});
  const std::size_t all = input.frames();
  const std::size_t wanted = arguments.full ? all : std::min(arguments.frames, all);
  std::size_t differing = 0;
  for (std::size_t k = 0; k < wanted; ++k) {
    // Evenly spaced, with the first and the last frame among them.
    const std::size_t frame = wanted > 1 ? k * (all - 1) / (wanted - 1) : 0;
    try {
      differing += check_frame(input, options, frame, arguments.full);
    } catch (const std::bad_alloc&) {
      throw Failure(
          fmt::format("{}: out of memory; the double loop keeps {} bytes a pair, twice "
                      "over",
                      input.name(frame), sizeof(Pair)));
    }
  }
  if (wanted < all) {
    print(fmt::format("{} of {} frames were checked; --frames N checks more\n", wanted, all));
  }
  print(differing ? fmt::format("{} runs DIFFER from the double loop\n", differing)
                  : std::string("all agree with the double loop\n"));
  return differing ? exit_differs : exit_done;
}

}  // namespace

Run add_check(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("check", "Compare every algorithm with a double loop");
  app.footer(help_text);
  add_input_arguments(app, arguments->input);
  app.add_option_function<std::string>(
         "--frames", common::count_into(arguments->frames, "--frames", 1, 1000000000),
         "of several frames, check so many (3)")
      ->type_name("N");
  app.add_flag("--full", arguments->full, "everything, whatever it takes");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
