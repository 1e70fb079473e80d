// throng-mpi model: estimates what each of many ranks would hold and send, by running the
// partitioning alone. Unit cubes at random in a cube, half a pair per box.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "apps/mpi/collective.hpp"
#include "apps/mpi/commands.hpp"
#include "apps/report/format.hpp"
#include "apps/report/table.hpp"
#include "apps/scenes/random.hpp"
#include "mpi/bisect.hpp"
#include "mpi/minimum_copies.hpp"

namespace throng::mpi_app {
namespace {

using mpi::Bounds;
using mpi::Key;

struct Arguments {
  std::vector<double> objects = {1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12};
  std::vector<int> ranks = {1, 8, 64, 512, 4096, 32768, 100000};
  double least = 1000;  // minimum boxes per rank; other rows are omitted
};

constexpr double record_size = 32;  // bytes of a box and its id

struct Cost {
  double copies_mean = 0, copies_max = 0, messages_mean = 0, messages_max = 0;
};

// Partitions a sample of the boxes, large enough for 160 points per region.
Cost simulate(double objects, int ranks) {
  const double side = 2 * std::cbrt(objects);  // half a pair per box: 8 n / side^3 = 1
  const auto count = static_cast<std::size_t>(std::min(objects, 160.0 * ranks));
  std::vector<mpi::Point> points(count);
  const scenes::Random random(1, 1);
  for (std::size_t i = 0; i < count; ++i) {
    for (unsigned k = 0; k < 3; ++k) {
      points[i].at[k] = mpi::key_of(static_cast<float>(side * scenes::unit(random.word(i, k))));
    }
    points[i].weight = 1;
  }
  const mpi::Regions regions = mpi::bisect(points.data(), points.size(), ranks);
  Cost cost;
  const double density = objects / (side * side * side);
  for (int rank = 0; rank < ranks; ++rank) {
    const Bounds b = regions.bounds(rank, rank + 1);
    double volume = 1, grown = 1;
    mpi::KeyBox key_box;
    for (int k = 0; k < 3; ++k) {
      const bool first = b.lower[k] <= mpi::key_of(0),
                 last = b.upper[k] > mpi::key_of(static_cast<float>(side));
      const double low = first ? 0 : static_cast<double>(mpi::float_of(b.lower[k]));
      const double high = last ? side : static_cast<double>(mpi::float_of(b.upper[k]));
      volume *= high - low;
      // A box up to one unit below overlaps this region, if there is a region below.
      grown *= high - low + (first ? 0 : 1);
      // The extent of this rank's boxes: lower corners in the region, upper ones one unit further.
      key_box.lower[k] = mpi::key_of(static_cast<float>(low));
      key_box.upper[k] = mpi::key_of(static_cast<float>(std::min(high + 1, side)));
    }
    int reached = -1;
    regions.visit(key_box, [&](int) { return ++reached >= 0; });
    const double copies = density * (grown - volume);
    cost.copies_mean += copies / ranks;
    cost.copies_max = std::max(cost.copies_max, copies);
    cost.messages_mean += static_cast<double>(reached) / ranks;
    cost.messages_max = std::max(cost.messages_max, static_cast<double>(reached));
  }
  return cost;
}

std::string short_text(double n) { return fmt::format("{:.0e}", n); }

void run(const Arguments& a) {
  if (rank_of(MPI_COMM_WORLD) != 0) return;
  report::Table table("Unit cubes, half a pair per box",
                      {"boxes", "ranks", "boxes per rank", "copies per rank, mean", "max",
                       "bytes, mean", "messages, mean", "max", "copies / minimum"});
  for (const double n : a.objects) {
    for (const int ranks : a.ranks) {
      if (ranks < 1)
        throw common::Failure(fmt::format("--ranks: found {}, wanted 1 or more", ranks));
      const double each = n / ranks;
      if (each < a.least) continue;
      const Cost c = simulate(n, ranks);
      const double side = 2 * std::cbrt(n);
      const double least = each * mpi::minimum_copies(ranks, side);
      table.add_row({short_text(n), fmt::format("{}", ranks), short_text(each),
                     fmt::format("{:.4g}", c.copies_mean), fmt::format("{:.4g}", c.copies_max),
                     report::format_bytes(c.copies_mean * record_size),
                     fmt::format("{:.1f}", c.messages_mean), fmt::format("{:.0f}", c.messages_max),
                     ranks == 1 ? "" : fmt::format("{:.2f}", c.copies_mean / least)});
    }
  }
  say(table.text(), MPI_COMM_SELF);
}

}  // namespace

Run add_model(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App& app =
      *program.add_subcommand("model", "Estimate the traffic of many ranks without running them");
  app.add_option("--objects", a->objects, "such as 1e6,1e9")->delimiter(',')->type_name("N,...");
  app.add_option("--ranks", a->ranks, "such as 8,64")->delimiter(',')->type_name("P,...");
  app.add_option("--least", a->least, "minimum boxes per rank; omit other rows (1000)")
      ->type_name("N");
  return [a] { run(*a); };
}

}  // namespace throng::mpi_app
