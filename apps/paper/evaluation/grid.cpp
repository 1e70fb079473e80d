// Tables 6 and 7: the grid's stages, and when a grid pays off.
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <throng/throng.hpp>

#include "apps/paper/cuda.hpp"
#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/failure.hpp"
#include "apps/report/format.hpp"

namespace throng::paper {
namespace {

// Randomly rotated spheres of radius 1/2 inside the scene's unit cubes.
std::vector<Transform> bodies_in(const Box* boxes, std::uint64_t n) {
  std::vector<Transform> transforms;
  for (std::uint64_t i = 0; i < n; ++i) {
    const Vec3 low = boxes[i].lower;
    const float half = 0.5f;
    const Quaternion turned =
        i % 2 == 0 ? Quaternion{0.5f, 0.5f, 0.5f, 0.5f} : Quaternion{0.6f, 0, 0, 0.8f};
    transforms.push_back({{low.x + half, low.y + half, low.z + half}, turned});
  }
  return transforms;
}

// From transforms to boxes, on the device that searches them.
double update_ms(const Lab& lab, const std::vector<Transform>& transforms, DeviceKind device) {
  const Shape sphere = Shape::sphere(0.5f);
  if (device == DeviceKind::cuda) {
    return time_bodies_on_cuda(transforms.data(), transforms.size(), sphere, lab.repeat());
  }
  const Bodies bodies(transforms.data(), transforms.size(), &sphere, 1);
  std::vector<Box> out(transforms.size());
  UpdateOptions options;
  options.threads = lab.setting().threads;
  return median_ms(
      [&] {
        const Result result = update_boxes(bodies, out.data(), options);
        if (!result.ok()) throw Failure(result.message);
      },
      lab.repeat(), lab.budget_ms());
}

// The X with the smallest total among those tried.
struct Best {
  double per_cell = 0;
  Lab::Measurement measurement;
};
Best best_grid(const Lab& lab, const Boxes& boxes, DeviceKind device) {
  Best best;
  const std::vector<double> all =
      lab.quick() ? std::vector<double>{2, 8} : std::vector<double>{1, 2, 4, 8, 16};
  for (const double per_cell : all) {
    Variant variant;
    variant.per_cell = per_cell;
    Lab::Measurement measurement = lab.run(variant, boxes.frame(0), boxes.n, device);
    if (best.measurement.measured && measurement.measured &&
        measurement.measured->step.times.total() >= best.measurement.measured->step.times.total()) {
      continue;
    }
    if (!measurement.measured && best.per_cell != 0) continue;
    best = {per_cell, std::move(measurement)};
  }
  return best;
}

struct PaperRow6 {
  std::uint64_t n;
  double boxes, grid, search, total;
};
constexpr PaperRow6 table6_rows[] = {{1000, 0.03, 0.13, 0.09, 0.25},
                                     {10000, 0.31, 1.45, 0.59, 2.35},
                                     {100000, 3.38, 11.12, 13.41, 27.91},
                                     {1000000, 14.26, 134.91, 142.72, 291.89}};

}  // namespace

Section table6(const Lab& lab) {
  Section section("table6", "Table 6: the stages with the grid");
  for (const DeviceKind device : lab.devices()) {
    report::Plot plot{"Table 6, " + lab.name(device), "objects", "ms", true, true, {}};
    report::Series own{"the paper's system", {}, {}, false, false};
    report::Series library{"Throng", {}, {}, true, false};
    report::Series paper{"paper: total", {}, {}, false, true};
    std::string gains, searches, grids;
    for (const PaperRow6& g : table6_rows) {
      const std::uint64_t n = g.n;
      paper.x.push_back(static_cast<double>(n));
      paper.y.push_back(g.total);
      if (lab.sizes({n}, 100000).empty()) continue;
      lab.say(fmt::format("Table 6: {} objects, {}", report::format_short(n), lab.name(device)));
      const Boxes boxes = make_scene("uniform", n, 1, 1);
      const double update = update_ms(lab, bodies_in(boxes.frame(0), n), device);
      const Best best = best_grid(lab, boxes, device);
      const std::string name = fmt::format("the paper's grid, X = {:g}", best.per_cell);
      const auto add = [&](const std::string& what, const char* quantity, double given,
                           double measured, const std::string& found = {}) -> Row& {
        Row row = lab.row(what, n, quantity, "ms", device);
        row.paper = given;
        row.measured = measured;
        row.found = found.empty() ? speed_sentence(row) : found;
        section.rows.push_back(std::move(row));
        return section.rows.back();
      };
      if (best.measurement.measured) {
        const Times& t = best.measurement.measured->step.times;
        const double total = update + t.upload + t.boxes + t.grid + t.search + t.download;
        add(name, "AABB update", g.boxes, update);
        add(name, "grid update", g.grid, t.grid);
        add(name, "search and transfers", g.search, t.upload + t.boxes + t.search + t.download);
        Row& row = add(name, "total", g.total, total);
        row.pairs = best.measurement.measured->step.pairs.size();
        row.checksum = best.measurement.measured->checksum;
        own.x.push_back(static_cast<double>(n));
        own.y.push_back(total);
        grids += fmt::format("{}{} at {}", grids.empty() ? "" : ", ",
                             report::format_ratio(g.total / total), report::format_short(n));
      } else {
        Row row = lab.row(name, n, "total", "ms", device);
        row.paper = g.total;
        row.found = best.measurement.skip_reason;
        section.rows.push_back(std::move(row));
      }
      const Lab::Library found = lab.library(boxes.frame(0), n, device);
      for (const bool alone : {true, false}) {
        Row& row = add("Throng", alone ? "pairs" : "AABB update and pairs", g.total,
                       alone ? found.ms : update + found.ms);
        row.pairs = found.pairs;
        row.checksum = found.checksum;
        row.found = fmt::format("{} less than the paper's GPU in all; {}",
                                report::format_ratio(1 / *row.ratio()), found.plan);
        std::string& ratios = alone ? searches : gains;
        ratios += fmt::format("{}{} at {}", ratios.empty() ? "" : ", ",
                              report::format_ratio(1 / *row.ratio()), report::format_short(n));
      }
      library.x.push_back(static_cast<double>(n));
      library.y.push_back(update + found.ms);
    }
    plot.series = {std::move(library), std::move(own), std::move(paper)};
    section.plots.push_back(std::move(plot));
    section.finding += fmt::format(
        "On {}, against the paper's GPU total: its own grid {} faster; Throng, its boxes given, {} "
        "faster, "
        "and with the update of the boxes {}. ",
        lab.name(device), grids, searches, gains);
  }
  section.words = {
      "Spheres with a position and a rotation each, whose boxes are computed first (AABB update); "
      "then the boxes are searched from scratch. The paper's grid is run with several X, and the "
      "one "
      "with the least total is reported. Its scene and density are not known; this is the scene "
      "uniform, "
      "half a pair per object."};
  return section;
}

Section table7(const Lab& lab) {
  Section section("table7", "Table 7: without and with the grid");
  struct PaperRow {
    std::uint64_t n;
    double without, with;
  };
  static constexpr PaperRow given[] = {
      {100, 0.046, 1.020}, {1000, 0.872, 1.840}, {10000, 31.450, 3.257}};
  for (const DeviceKind device : lab.devices()) {
    report::Plot plot{"Table 7, " + lab.name(device), "objects", "ms", true, true, {}};
    report::Series lines[4] = {{"brute force, one bit", {}, {}, false, false},
                               {"grid", {}, {}, true, false},
                               {"paper: without grid", {}, {}, false, true},
                               {"paper: with grid", {}, {}, false, true}};
    std::uint64_t first_grid_win = 0;
    for (const std::uint64_t n :
         lab.sizes({30, 50, 100, 200, 300, 500, 1000, 2000, 3000, 10000}, 10000)) {
      lab.say(fmt::format("Table 7: {} objects, {}", n, lab.name(device)));
      const Boxes boxes = make_scene("uniform", n, 1, 1);
      Variant variant;
      const Lab::Measurement brute = lab.run(variant, boxes.frame(0), n, device);
      variant.per_cell = 8;
      const Lab::Measurement grid = lab.run(variant, boxes.frame(0), n, device);
      if (!brute.measured || !grid.measured) continue;
      Row rows[2] = {lab.row("without grid, one bit a pair", n, "total", "ms", device),
                     lab.row("with grid, X = 8", n, "total", "ms", device)};
      const Lab::Measurement* answers[2] = {&brute, &grid};
      for (int k = 0; k < 2; ++k) {
        rows[k].measured = answers[k]->measured->step.times.total();
        rows[k].pairs = answers[k]->measured->step.pairs.size();
        rows[k].checksum = answers[k]->measured->checksum;
        lines[k].x.push_back(static_cast<double>(n));
        lines[k].y.push_back(*rows[k].measured);
      }
      const bool grid_wins = *rows[1].measured < *rows[0].measured;
      if (grid_wins && first_grid_win == 0) first_grid_win = n;
      for (const PaperRow& g : given) {
        if (g.n != n) continue;
        rows[0].paper = g.without;
        rows[1].paper = g.with;
        rows[1].found = grid_wins == (g.with < g.without) ? "agrees on which is faster"
                                                          : "differs: here the other one is faster";
        rows[0].found = speed_sentence(rows[0]);
      }
      for (Row& row : rows) section.rows.push_back(std::move(row));
    }
    for (const PaperRow& g : given) {
      lines[2].x.push_back(static_cast<double>(g.n));
      lines[2].y.push_back(g.without);
      lines[3].x.push_back(static_cast<double>(g.n));
      lines[3].y.push_back(g.with);
    }
    for (report::Series& line : lines) plot.series.push_back(std::move(line));
    section.plots.push_back(std::move(plot));
    Row row = lab.row("fewest objects, of those tried, for which the grid is faster", 0, "",
                      "objects", device);
    row.paper_text = "1,000 (section 5), 3,000 (section 3.5)";
    row.measured_text = first_grid_win == 0 ? "none" : report::format_count(first_grid_win);
    row.found = "the paper's Table 7 itself has the brute force ahead at 1,000";
    section.rows.push_back(row);
    section.finding +=
        first_grid_win == 0
            ? fmt::format("On {} the brute force wins at all sizes tried. ", lab.name(device))
            : fmt::format("On {} the grid wins from {} objects on, at the latest. ",
                          lab.name(device), report::format_count(first_grid_win));
  }
  return section;
}

}  // namespace throng::paper
