// throng-paper: the paper's own system, every part of it a choice on the command line.
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/version.hpp>

#include "apps/common/print.hpp"
#include "apps/paper/commands.hpp"
#include "apps/paper/cuda.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/input.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::paper {
namespace {

const char* help_text =
    R"(With -o DIR and no command it measures the paper's evaluation on this machine: its tables and figures as
text, as CSV files and as one page, DIR/index.html. --quick takes under two minutes on two cores, the
full run about twenty. Progress goes to standard error.

Examples:
  throng-paper --quick -o paper
  throng-paper --only table3 --only table4 -o paper
  throng-paper --list
  throng-paper pairs --scene uniform --objects 5K --write racy --check
  throng-paper pairs boxes.npy --mapping formula --root carmack --steps 2 --json
  throng-paper pairs --scene uniform --objects 100K --grid 8 --device cuda --repeat 21
'throng-paper pairs --help' lists the options for one variant.
Exit status: 0 done, 1 --check found a difference, 2 bad input or a missing feature.)";

const char* variants_text =
    R"(--mapping   how a thread computes its pair from its index
  formula   formulas (1) and (2) with the square root that --root names
  lazy      row t / n, column t % n; more than half of the threads have no pair
  stored    a list of all pairs in memory, 8 bytes each
  fold      the triangle folded into a rectangle: one division, no root; exact
  exact     the formula with a root that an integer step corrects; the same as --root exact
--root      in the formula
  float32, float64   the hardware's
  carmack, lomont    fast inverse root, constant 0x5f3759df or 0x5f375a86, --steps 1 to 4
  exact              corrected in integers
--repair, --no-repair   the paper's two repairs of a row that is off by one
--radicand  integer: computed exactly; real: in the root's own floating point
--output    bit or byte for each thread; pairs: a list through a counter
--write     of bits
  racy      read, OR, write, by eight threads on one byte, as in the paper: loses pairs
  atomic    one atomic OR
  ballot    a warp votes, one lane writes the word
  owned     one thread tests the 32 pairs of a word
--grid X    the density grid, X objects a cell, the mapping inside each cell; output is pairs
--device    cpu or cuda
)";

int list() {
  std::string text = variants_text;
  const std::string reason = why_no_cuda();
  text += "  cuda here: " + (reason.empty() ? cuda_device_name() : reason) + "\nscenes     ";
  for (const std::string& scene : scenes::names()) text += " " + scene;
  common::print(text + "\n");
  return exit_done;
}

int dispatch(int argc, char** argv) {
  CLI::App app("The system of Avril, Gouranton and Arnaldi (EGPGV 2012).", "throng-paper");
  app.footer(help_text);
  app.set_version_flag("--version", "throng-paper " THRONG_VERSION);
  bool listed = false;
  app.add_flag("--list", listed, "list all variants, and whether there is a GPU");
  app.require_subcommand(0, 1);
  std::vector<std::pair<std::string, Run>> runs;
  runs.emplace_back("pairs", add_pairs(app));
  const Run evaluate = add_evaluate(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? exit_done : exit_bad;
  }
  if (listed) return list();
  for (const auto& [name, run] : runs) {
    if (app.got_subcommand(name)) return run();
  }
  return evaluate();
}

int guarded(int argc, char** argv) {
  std::string message = "out of memory";
  try {
    return dispatch(argc, argv);
  } catch (const std::bad_alloc&) {
    // Out of memory: no formatting.
  } catch (const std::exception& error) {
    message = error.what();
  }
  std::fputs(("throng-paper: " + message + "\n").c_str(), stderr);
  return exit_bad;
}

}  // namespace
}  // namespace throng::paper

int main(int argc, char** argv) { return throng::paper::guarded(argc, argv); }
