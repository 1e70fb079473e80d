#include "apps/report/explanation.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "apps/report/format.hpp"
#include "apps/report/plot.hpp"

namespace throng::report {
namespace {

std::string ms_text(double ms) { return format_ms(ms) + " ms"; }

std::string size_text(const Explanation::SizeClass& c) {
  if (c.below == 0) return "no extent";
  return c.from == c.below ? std::string("infinite") : fmt::format("{:g} to {:g}", c.from, c.below);
}

std::string place_text(const Box& b) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g})", b.lower.x, b.lower.y,
                     b.lower.z, b.upper.x, b.upper.y, b.upper.z);
}

}  // namespace

Table explanation_summary(const Explanation& e) {
  const Plan& plan = e.result.plan;
  Table table("What was done", {"", ""});
  const auto row = [&](const char* what, const std::string& value) {
    table.add_row({what, value});
  };
  row("algorithm", fmt::format("{}, {}, {} thread{}", to_string(plan.algorithm),
                               to_string(plan.isa), plan.threads, plan.threads == 1 ? "" : "s"));
  row("because", plan.reason);
  row("boxes", format_count(e.boxes));
  row("inactive", format_count(e.result.inactive));
  row("pairs", format_count(e.result.found));
  if (e.cells > 0) {
    row("cells", fmt::format("{} ({} x {} x {}, swept along {}), {} with a box in them",
                             format_count(e.cells), plan.columns[0], plan.columns[1],
                             plan.columns[2], "xyz"[plan.sweep_axis], format_count(e.occupied)));
    row("cells per box", fmt::format("{:.3g}", static_cast<double>(e.entries) /
                                                   static_cast<double>(e.boxes ? e.boxes : 1)));
  } else {
    row("cells", "no single grid for all boxes");
  }
  row("tests", format_count(e.result.comparisons));
  row("visited", format_count(e.result.visited));
  row("tests per pair", fmt::format("{:.3g}", e.tests_per_pair));
  row("tests per box", fmt::format("{:.3g}", e.tests_per_box));
  const StageTimes& t = e.result.times;
  row("time", ms_text(t.total_ms));
  row("  plan, bin, find, order",
      fmt::format("{}, {}, {}, {}", ms_text(t.plan_ms), ms_text(t.bin_ms), ms_text(t.find_ms),
                  ms_text(t.order_ms)));
  row("memory", format_bytes(static_cast<double>(e.memory_bytes)));
  return table;
}

std::vector<Table> explanation_details(const Explanation& e) {
  Table sizes("Sizes: the largest extent", {"from, to below", "boxes", "cells per box"});
  for (const auto& c : e.size_classes) {
    sizes.add_row({size_text(c), format_count(c.boxes),
                   e.cells > 0 ? fmt::format("{:.3g}", c.cells_per_box) : ""});
  }
  Table largest("The largest boxes", {"index", "set", "extent", "cells"});
  for (const auto& l : e.largest) {
    largest.add_row({std::to_string(l.index), l.in_second_set ? "second" : "first",
                     fmt::format("{:.4g}", l.extent), e.cells > 0 ? format_count(l.cells) : ""});
  }
  Table densest("The densest cells", {"boxes", "where"});
  for (const auto& c : e.densest) {
    densest.add_row({format_count(c.boxes), place_text(c.bounds)});
  }
  Table cells("How full the cells are", {"boxes in a cell", "cells", "boxes in all of them"});
  for (const auto& c : e.cell_classes) {
    cells.add_row({c.below == c.from + 1
                       ? format_count(c.from)
                       : fmt::format("{} to {}", format_count(c.from), format_count(c.below - 1)),
                   format_count(c.cells), format_count(c.boxes)});
  }
  Table memory("Memory", {"for", "bytes"});
  for (const auto& part : e.memory) memory.add_row({part.what, format_count(part.bytes)});
  std::vector<Table> tables;
  for (Table* table : {&sizes, &largest, &cells, &densest, &memory}) {
    if (table->rows() > 0) tables.push_back(std::move(*table));
  }
  return tables;
}

void explain(Page& page, const Explanation& e) {
  page.add(explanation_summary(e));
  Table advice("What would make it faster", {""});
  for (const std::string& line : e.advice) advice.add_row({line});
  if (e.advice.empty()) advice.add_row({"nothing stands out"});
  page.add(advice);
  // A size class is drawn at the middle of its factor of two; points and infinite boxes are left
  // out.
  Plot sizes, cells;
  Series boxes{"boxes", {}, {}, true, false};
  Series cell_boxes{"boxes in such cells", {}, {}, true, false},
      cell_count{"cells", {}, {}, false, true};
  for (const auto& c : e.size_classes) {
    boxes.x.push_back(c.from * std::sqrt(2.0));
    boxes.y.push_back(static_cast<double>(c.boxes));
  }
  for (const auto& c : e.cell_classes) {
    const double middle = static_cast<double>(c.from) * (c.from == 1 ? 1 : std::sqrt(2.0));
    cell_boxes.x.push_back(middle);
    cell_boxes.y.push_back(static_cast<double>(c.boxes));
    cell_count.x.push_back(middle);
    cell_count.y.push_back(static_cast<double>(c.cells));
  }
  sizes.title = "Boxes by size";
  sizes.x_label = "largest extent, world units";
  sizes.y_label = "boxes";
  sizes.series = {boxes};
  cells.title = "How full the cells are";
  cells.x_label = "boxes in a cell";
  cells.y_label = "count";
  cells.series = {cell_boxes, cell_count};
  std::vector<Plot> plots = {sizes};
  if (!e.cell_classes.empty()) plots.push_back(cells);
  for (Plot& plot : plots) {
    plot.log_x = plot.log_y = true;
    plot.width = 560;
    plot.height = 360;
  }
  page.add(plots);
  for (const Table& table : explanation_details(e)) page.add(table);
}

}  // namespace throng::report
