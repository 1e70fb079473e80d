// throng-mpi: the command line program of the search across MPI ranks.
#include <mpi.h>

#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/version.hpp>

#include "apps/common/failure.hpp"
#include "apps/mpi/collective.hpp"
#include "apps/mpi/commands.hpp"
#include "apps/mpi/devices.hpp"

namespace throng::mpi_app {
namespace {

int dispatch(int argc, char** argv) {
  CLI::App app("throng-mpi finds every pair of overlapping boxes on many ranks.", "throng-mpi");
  app.set_version_flag("--version", "throng-mpi " THRONG_VERSION);
  app.require_subcommand(1);
  const std::vector<std::pair<std::string, Run>> runs = {
      {"pairs", add_pairs(app)}, {"bench", add_bench(app)}, {"model", add_model(app)}};
  // Parse errors normally occur on every rank; run_collectively() handles those on some ranks only.
  int status = common::exit_done;
  bool parsed = false;
  run_collectively(MPI_COMM_WORLD, [&] {
    try {
      app.parse(argc, argv);
      parsed = true;
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() != 0) throw common::Failure(error.what());
      if (rank_of(MPI_COMM_WORLD) == 0) app.exit(error);  // help
    }
  });
  if (!parsed) return status;
  for (const auto& [name, run] : runs) {
    if (app.got_subcommand(name)) run();
  }
  return status;
}

int guarded(int argc, char** argv) {
  std::string words = "out of memory";
  int status = common::exit_bad;
  try {
    return dispatch(argc, argv);
  } catch (const common::Failure& failure) {
    words = failure.what();
    status = failure.status();
  } catch (const std::bad_alloc&) {
    // no memory for a longer message
  } catch (const std::exception& failure) {
    words = failure.what();
  }
  // One line per rank; the launcher decides which of them the user sees.
  std::fputs(("throng-mpi: " + words + "\n").c_str(), stderr);
  return status;
}

}  // namespace
}  // namespace throng::mpi_app

int main(int argc, char** argv) {
  throng::mpi_app::choose_device();
  if (MPI_Init(&argc, &argv) != MPI_SUCCESS) return throng::common::exit_bad;
  MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
  const int status = throng::mpi_app::guarded(argc, argv);
  MPI_Finalize();
  return status;
}
