// throng: finds all pairs of overlapping boxes, on the command line.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/find_pairs.hpp>
#include <throng/version.hpp>

#include "apps/common/child_process.hpp"
#include "apps/common/interrupt.hpp"
#include "apps/common/sibling_program.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"

namespace throng::cli {
namespace {

const char* help_text =
    R"(Examples:
  throng demo
  throng scene uniform --objects 100K -o boxes.npy
  throng pairs boxes.npy
  throng mesh model.obj --picture model.png
  mpirun -n 4 throng pairs --mpi boxes.npy
  throng check boxes.npy
'throng COMMAND --help' lists the options of each.
Exit status: 0 done, 1 a check found a difference, 2 bad input, bad usage or an output that failed;
130, 143 or 129: ended by SIGINT (Ctrl-C), SIGTERM or SIGHUP, 141: the reader closed its output.)";

// Commands that are sibling programs.
struct SiblingProgram {
  const char* command;
  const char* program;
  const char* description;
  const char* install_hint;  // how to configure a build with it
};
constexpr SiblingProgram sibling_programs[] = {
    {"bench", "throng-bench", "Measure against other libraries",
     "configure with -DTHRONG_BUILD_BENCH=ON (packages libcli11-dev, libfmt-dev, "
     "nlohmann-json3-dev; scripts/bench installs the competitors, too)"},
    {"paper", "throng-paper", "The paper's tables and figures, measured here",
     "configure with -DTHRONG_BUILD_CLI=ON"},
    {"simulate", "throng-simulate", "Rigid bodies fall on a plane, in a physics engine",
     "install Bullet (package libbullet-dev), configure with -DTHRONG_BUILD_CLI=ON"},
};
// `pairs --mpi` and `bench --mpi`: the same commands of the MPI program.
constexpr const char* mpi_install_hint =
    "install MPI (packages libopenmpi-dev, openmpi-bin), configure with -DTHRONG_MPI=ON";
constexpr SiblingProgram across_ranks[] = {{"pairs --mpi", "throng-mpi", "", mpi_install_hint},
                                           {"bench --mpi", "throng-mpi", "", mpi_install_hint}};

const SiblingProgram* sibling_program_of(const std::string& command) {
  for (const SiblingProgram& sibling_program : sibling_programs) {
    if (command == sibling_program.command) return &sibling_program;
  }
  return nullptr;
}

int start(const SiblingProgram& sibling_program, const std::vector<std::string>& arguments) {
  const std::string path = common::find_sibling_program(sibling_program.program);
  if (path.empty()) {
    throw Failure(
        fmt::format("{}: found no program {} in this program's folder; {}, then build it: "
                    "cmake --build BUILD --target {}",
                    sibling_program.command, sibling_program.program, sibling_program.install_hint,
                    sibling_program.program));
  }
  common::restore_write_signals();  // an ignored signal would stay ignored in the other program
  return common::run_instead(path, arguments);
}

// An empty argument is an unset variable of a script; it differs from no option.
void refuse_empty(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    if (option->get_items_expected_max() == 0) continue;
    option->check([](const std::string& text) {
      return text.empty() ? std::string("found an empty argument, wanted a value") : std::string();
    });
  }
}

int dispatch(int argc, char** argv) {
  // Their arguments, --help included, are passed through unparsed.
  if (argc > 1) {
    std::vector<std::string> arguments(argv + 1, argv + argc);
    const auto mpi = std::find(arguments.begin(), arguments.end(), "--mpi");
    if (mpi != arguments.end() && (arguments[0] == "pairs" || arguments[0] == "bench")) {
      arguments.erase(mpi);
      return start(across_ranks[arguments[0] == "bench"], arguments);
    }
    if (const SiblingProgram* sibling_program = sibling_program_of(argv[1])) {
      return start(*sibling_program, {argv + 2, argv + argc});
    }
  }
  CLI::App app("Finds all pairs of overlapping boxes, and of intersecting triangles.", "throng");
  app.allow_windows_style_options(false);  // /data/boxes.npy is a file
  app.footer(help_text);
  app.set_version_flag("--version", "throng " THRONG_VERSION);
  app.require_subcommand(1);
  std::vector<std::pair<std::string, Run>> runs;
  runs.emplace_back("demo", add_demo(app));
  runs.emplace_back("pairs", add_pairs(app));
  runs.emplace_back("mesh", add_mesh(app));
  runs.emplace_back("scene", add_scene(app));
  runs.emplace_back("check", add_check(app));
  runs.emplace_back("replay", add_replay(app));
  runs.emplace_back("explain", add_explain(app));
  for (const SiblingProgram& sibling_program : sibling_programs) {
    // `bench` is listed even if not built, so that its message says how to build it.
    if (std::string(sibling_program.command) == "bench" ||
        !common::find_sibling_program(sibling_program.program).empty()) {
      app.add_subcommand(sibling_program.command, sibling_program.description);
    }
  }
  const auto is_own = [](const std::string& option) {
    return option == "-h" || option == "--help" || option == "--version";
  };
  if (argc > 1 && !is_own(argv[1])) {
    std::string commands;
    bool known = false;
    for (const CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) {
      commands += (commands.empty() ? "" : ", ") + command->get_name();
      known = known || command->get_name() == argv[1];
    }
    if (!known && argv[1][0] == '-') {
      throw Failure(
          fmt::format("found '{}', wanted --help, --version or a command: {}", argv[1], commands));
    }
    if (!known) {
      throw Failure(fmt::format("found no command '{}', wanted one of: {}", argv[1], commands));
    }
  }
  if (argc == 1) {
    print(app.help());
    return exit_done;
  }
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
    refuse_empty(*command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? exit_done : exit_bad;
  }
  for (const auto& [name, run] : runs) {
    if (app.got_subcommand(name)) return run();
  }
  return exit_bad;
}

int guarded(int argc, char** argv) {
  try {
    const int status = dispatch(argc, argv);
    finish_output();
    return status;
  } catch (const BrokenPipe&) {
    return exit_broken_pipe;
  } catch (const common::Interrupted& interrupted) {
    print_error("throng: interrupted; no partial file is left");
    return interrupted.status();
  } catch (const Failure& failure) {
    print_error(fmt::format("throng: {}", failure.what()));
    return failure.status();
  } catch (const std::bad_alloc&) {
    print_error("throng: out of memory");
  } catch (const std::exception& error) {
    print_error(fmt::format("throng: {}", error.what()));
  }
  return exit_bad;
}

}  // namespace
}  // namespace throng::cli

int main(int argc, char** argv) {
  throng::common::ignore_write_signals();
  return throng::cli::guarded(argc, argv);
}
