// What the paper leaves open: how many objects a cell should have, and how large the library's
// cells should be, over five scenes.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "apps/paper/evaluation/experiments.hpp"
#include "apps/report/format.hpp"

namespace throng::paper {
namespace {

struct Curve {
  report::Series line;
  double best_x = 0, best_ms = 0;

  void add(double x, double ms) {
    line.x.push_back(x);
    line.y.push_back(ms);
    if (best_ms == 0 || ms < best_ms) best_ms = ms, best_x = x;
  }
  // Time at x over the best time; 0 where it was not measured.
  double at(double x) const {
    for (std::size_t i = 0; i < line.x.size(); ++i) {
      if (line.x[i] == x) return line.y[i] / best_ms;
    }
    return 0;
  }
};

}  // namespace

Section cell_study(const Lab& lab) {
  Section section("study", "What the paper left open: X, and the size of cells");
  const std::uint64_t n =
      std::min<std::uint64_t>(lab.quick() ? 10000 : 100000, lab.setting().up_to);
  const char* const names[] = {"uniform", "pile", "spheres", "mixed", "clusters"};
  const std::vector<double> per_cells =
      lab.quick() ? std::vector<double>{0.5, 2, 8, 32}
                  : std::vector<double>{0.125, 0.25, 0.5, 1, 2, 4, 8, 16, 32, 64};
  const std::vector<double> scales =
      lab.quick() ? std::vector<double>{0.5, 1, 2}
                  : std::vector<double>{0.25, 0.35, 0.5, 0.7, 1, 1.4, 2, 2.8, 4};
  for (const DeviceKind device : lab.devices()) {
    report::Plot grids{
        fmt::format("The paper's grid, {} objects, {}", report::format_short(n), lab.name(device)),
        "objects per cell, X",
        "ms",
        true,
        true,
        {}};
    report::Plot cells{
        fmt::format("Throng, {} objects, {}", report::format_short(n), lab.name(device)),
        "cells, times the planner's",
        "ms",
        true,
        true,
        {}};
    double worst_plan = 1, min_x = 0, max_x = 0;
    std::string worst_scene, best_texts;
    for (const char* const name : names) {
      const Boxes boxes = make_scene(name, n, 1, 1);
      Curve curve{{name, {}, {}, false, false}};
      std::string skip_reason;
      for (const double per_cell : per_cells) {
        lab.say(fmt::format("study: {}, X = {:g}, {}", name, per_cell, lab.name(device)));
        Variant variant;
        variant.per_cell = per_cell;
        const Lab::Measurement measurement = lab.run(variant, boxes.frame(0), n, device);
        if (measurement.measured) {
          curve.add(per_cell, measurement.measured->step.times.total());
        } else {
          skip_reason += fmt::format("; X = {:g} {}", per_cell, measurement.skip_reason);
        }
      }
      Row row = lab.row(name, n, "best X of the paper's grid", "objects per cell", device);
      if (curve.best_ms > 0) {
        row.measured = curve.best_x;
        row.found = fmt::format("{} ms there{}", report::format_ms(curve.best_ms), skip_reason);
        for (const double x : {1.0, 2.0, 4.0, 8.0, 32.0}) {
          if (curve.at(x) > 0) {
            row.found += fmt::format("; X = {:g}: {}", x, report::format_ratio(curve.at(x)));
          }
        }
        best_texts +=
            fmt::format("{}{:g} for {}", best_texts.empty() ? "" : ", ", curve.best_x, name);
        min_x = min_x == 0 ? curve.best_x : std::min(min_x, curve.best_x);
        max_x = std::max(max_x, curve.best_x);
        grids.series.push_back(curve.line);
      } else {
        row.found = skip_reason;
      }
      section.rows.push_back(row);

      curve = {{name, {}, {}, false, false}};
      for (const double scale : scales) {
        lab.say(fmt::format("study: {}, cells {:g} times, {}", name, scale, lab.name(device)));
        curve.add(scale, lab.library(boxes.frame(0), n, device, 1, static_cast<float>(scale)).ms);
      }
      row = lab.row(name, n, "best cell of Throng's, 1 thread", "times the planner's", device);
      row.measured = curve.best_x;
      const double loss = curve.at(1);
      row.found =
          fmt::format("the planner's choice takes {} of the best time", report::format_ratio(loss));
      if (loss > worst_plan) worst_plan = loss, worst_scene = name;
      section.rows.push_back(row);
      cells.series.push_back(curve.line);
    }
    section.finding += fmt::format(
        "On {} the best X is {}{}. The planner of Throng, which is given no X, is {}. ",
        lab.name(device), best_texts, max_x > min_x ? ": no one value serves all" : "",
        worst_scene.empty() ? std::string("at the best size of all tried in every scene")
                            : fmt::format("at most {} of the best time away, in the scene {}",
                                          report::format_ratio(worst_plan), worst_scene));
    section.plots.push_back(std::move(grids));
    section.plots.push_back(std::move(cells));
  }
  section.words = {
      "X is the number of objects per cell that the paper leaves to be tuned. Throng takes no such "
      "number: a planner looks at a sample of the boxes. Here its cells are made so many times as "
      "long and wide, to see what its choice costs."};
  return section;
}

}  // namespace throng::paper
