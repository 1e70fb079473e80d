// throng-bench: Throng compared with other libraries. Starts a subcommand.
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include <throng/throng.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/failure_text.hpp"
#include "apps/common/machine.hpp"
#include "apps/common/numbers.hpp"
#include "bench/subcommands.hpp"

namespace throng::bench {
namespace {

struct Subcommand {
  const char* name;
  int (*run)(int argc, char** argv);
  const char* about;
};

constexpr Subcommand subcommands[] = {
    {"search", search_command, "All pairs of boxes that all move, compared with other libraries"},
    {"moving", moving_command, "Frames in which some boxes move, with begin and end events"},
    {"queries", queries_command, "Ray casts and overlap queries among boxes that move"},
    {"filters", filters_command, "Searches with groups, masks, owners, worlds and static boxes"},
    {"doubles", doubles_command, "Boxes of doubles"},
    {"bodies", bodies_command, "Boxes computed from transforms and shapes"},
    {"mesh", mesh_command, "Intersecting triangles of meshes"},
    {"frames", frames_command, "One method through the frames of a scene, a line per frame"},
#if defined(THRONG_TUNE_COSTS)
    {"costs", costs_command, "What each tuned number of the library is worth"},
#endif
#if defined(THRONG_BENCH_GPU)
    {"gpu", gpu_command, "The CUDA backend, boxes and pairs in device memory"},
#endif
};

void print_help() {
  fmt::print(
      "Throng compared with other libraries, on scenes and on files.\n\n"
      "Usage: throng-bench [SUBCOMMAND] [OPTIONS]\n\nSubcommands:\n");
  for (const Subcommand& s : subcommands) fmt::print("  {:<9} {}\n", s.name, s.about);
  fmt::print(
      "\nWithout a subcommand: search. `throng-bench SUBCOMMAND --help` lists its options.\n\n"
      "Examples:\n"
      "  throng-bench --quick\n"
      "  throng-bench search boxes.npy --csv search.csv --html search.html\n"
      "  throng-bench moving --quick --csv moving.csv\n"
      "Exit status: 0 done, 1 results differ, 2 bad usage or a bad file.\n");
}

int guarded(const Subcommand& s, int argc, char** argv) {
  std::string message = "out of memory";
  int status = common::exit_bad;
  try {
    return s.run(argc, argv);
  } catch (const Error& e) {
    message = common::failure_text(e.result(), {});
  } catch (const common::Failure& e) {
    message = e.what();
    status = e.status();
  } catch (const std::bad_alloc&) {
    // The message is set.
  } catch (const std::length_error&) {
    // A vector that no memory can hold: the same message.
  } catch (const std::exception& e) {
    message = e.what();
  }
  std::fflush(stdout);
  std::fputs(fmt::format("throng-bench {}: {}\n", s.name, message).c_str(), stderr);
  return status;
}

}  // namespace

void add_output_options(CLI::App& app, OutputOptions& options) {
  app.add_option("--csv", options.csv, "Write all values to this file");
  app.add_option("--machine", options.machine, "Name of this machine in the CSV file");
  app.add_option("--commit", options.commit, "Commit of the library in the CSV file");
}

bool parse_case_options(CLI::App& app, CaseOptions& options, const std::string& only, int argc,
                        char** argv, int& status) {
  add_output_options(app, options.output);
  if (!only.empty())
    app.add_option("--only", options.only, "Only cases whose " + only + " contains this");
  app.add_option("--threads", options.threads, "Thread counts, such as 1,2; 1 and all by default")
      ->delimiter(',')
      ->check(CLI::Range(1, 1024));
  app.add_option_function<std::string>(
      "--max-objects", common::count_into(options.max_objects, "--max-objects", 100, max_box_count),
      "At most so many boxes in each case, such as 10K");
  app.add_option("--rounds", options.rounds, "Rounds or frames per case")
      ->check(CLI::Range(1, 1000000));
  app.add_flag("--quick", options.quick, "At most 10K boxes and 5 rounds per case");
  status = common::exit_done;
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    status = app.exit(e) == 0 ? common::exit_done : common::exit_bad;
    return false;
  }
  if (options.quick) {
    if (!options.max_objects) options.max_objects = 10000;
    if (!options.rounds) options.rounds = 5;
  }
  if (options.threads.empty()) {
    options.threads = {1};
    if (common::hardware_threads() > 1) options.threads.push_back(common::hardware_threads());
  }
  return true;
}

}  // namespace throng::bench

int main(int argc, char** argv) {
  using namespace throng::bench;
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") {
    print_help();
    return 0;
  }
  for (const Subcommand& s : subcommands)
    if (first == s.name) return guarded(s, argc - 1, argv + 1);
  return guarded(subcommands[0], argc, argv);
}
