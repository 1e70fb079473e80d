#include "apps/report/explanation.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "apps/report/format.hpp"

namespace throng::report {
namespace {

std::string ms_text(double ms) { return format_ms(ms) + " ms"; }

std::string size_text(const Explanation::SizeClass& c) {
  if (c.below == 0) return "0";
  return c.from == c.below ? std::string("infinite") : fmt::format("{:g} to {:g}", c.from, c.below);
}

std::string corner_text(const Vec3& p) {
  return fmt::format("{:.4g}, {:.4g}, {:.4g}", p.x, p.y, p.z);
}

// Whether the largest box is more than four times as large as the median box.
bool sizes_differ(const Explanation& e) {
  std::uint64_t boxes = 0, passed = 0;
  for (const auto& c : e.size_classes) boxes += c.boxes;
  for (const auto& c : e.size_classes) {
    passed += c.boxes;
    if (2 * passed >= boxes) return !e.largest.empty() && e.largest.front().extent > 4 * c.below;
  }
  return false;
}

}  // namespace

Table explanation_summary(const Explanation& e) {
  const Plan& plan = e.result.plan;
  Table table("The search", {"", ""});
  const auto row = [&](const char* what, const std::string& value) {
    table.add_row({what, value});
  };
  row("boxes", e.result.inactive == 0
                   ? format_count(e.boxes)
                   : fmt::format("{}, of which {} are inactive", format_count(e.boxes),
                                 format_count(e.result.inactive)));
  row("pairs", format_count(e.result.found));
  row("time", ms_text(e.result.times.total_ms));
  const StageTimes& t = e.result.times;
  row("  of which",
      fmt::format("plan {}, sort boxes into cells {}, find pairs {}, sort pairs {}",
                  ms_text(t.plan_ms), ms_text(t.bin_ms), ms_text(t.find_ms), ms_text(t.order_ms)));
  row("method", fmt::format("{}, {}, {} thread{}", to_string(plan.algorithm), to_string(plan.isa),
                            plan.threads, plan.threads == 1 ? "" : "s"));
  row("reason", plan.reason);
  if (e.cells > 0) {
    row("cells",
        fmt::format("{} ({} x {} x {}); {} have boxes; each box is in {:.3g} on average",
                    format_count(e.cells), plan.columns[0], plan.columns[1], plan.columns[2],
                    format_count(e.occupied),
                    static_cast<double>(e.entries) / static_cast<double>(e.boxes ? e.boxes : 1)));
  } else {
    row("cells", "not one grid for all boxes");
  }
  row("tests",
      fmt::format("{} pairs of boxes compared: {:.3g} tests per pair found, {:.3g} per box",
                  format_count(e.result.comparisons), e.tests_per_pair, e.tests_per_box));
  std::string parts;
  for (const auto& part : e.memory)
    parts += fmt::format("{}{} {}", parts.empty() ? ": " : ", ", part.what,
                         format_bytes(static_cast<double>(part.bytes)));
  row("memory", format_bytes(static_cast<double>(e.memory_bytes)) + parts);
  return table;
}

std::vector<Bars> explanation_histograms(const Explanation& e) {
  Bars sizes{"Boxes by size", "largest side", "boxes", {}},
      cells{"Cells by number of boxes", "boxes in a cell", "cells", {}};
  for (const auto& c : e.size_classes)
    sizes.bars.push_back({size_text(c), static_cast<double>(c.boxes)});
  for (const auto& c : e.cell_classes)
    cells.bars.push_back({c.below == c.from + 1 ? format_count(c.from)
                                                : fmt::format("{} to {}", format_count(c.from),
                                                              format_count(c.below - 1)),
                          static_cast<double>(c.cells)});
  std::vector<Bars> histograms;
  for (Bars* bars : {&sizes, &cells})
    if (!bars->bars.empty()) histograms.push_back(std::move(*bars));
  return histograms;
}

std::vector<Table> explanation_details(const Explanation& e) {
  Table candidates("The methods and their prices", {"expected on one thread", "method"});
  for (const auto& c : e.candidates) {
    const std::string grid = fmt::format("grid of {} x {} x {}, swept along {}", c.columns[0],
                                         c.columns[1], c.columns[2], "xyz"[c.sweep_axis]);
    const Plan& plan = e.result.plan;
    const bool brute = c.algorithm == Algorithm::all_pairs;
    const bool chosen = c.algorithm == plan.algorithm &&
                        (brute || std::equal(c.columns, c.columns + 3, plan.columns));
    candidates.add_row({fmt::format("{:.4g} us", c.expected_ns * 1e-3),
                        (brute ? "brute force" : grid) + (chosen ? ", chosen" : "")});
  }
  Table largest("The largest boxes", {"index", "set", "largest side", "cells"});
  for (const auto& l : e.largest) {
    largest.add_row({std::to_string(l.index), l.in_second_set ? "second" : "first",
                     fmt::format("{:.4g}", l.extent), e.cells > 0 ? format_count(l.cells) : ""});
  }
  Table densest("The cells with the most boxes", {"boxes", "from x, y, z", "to x, y, z"});
  for (const auto& c : e.densest) {
    densest.add_row(
        {format_count(c.boxes), corner_text(c.bounds.lower), corner_text(c.bounds.upper)});
  }
  std::vector<Table> tables;
  if (candidates.rows() > 0) tables.push_back(std::move(candidates));
  if (sizes_differ(e)) tables.push_back(std::move(largest));
  if (densest.rows() > 0) tables.push_back(std::move(densest));
  return tables;
}

void explain(Page& page, const Explanation& e) {
  page.add(explanation_summary(e));
  Table advice("What would make it faster", {""});
  for (const std::string& line : e.advice) advice.add_row({line});
  if (e.advice.empty()) advice.add_row({"nothing stands out"});
  page.add(advice);
  page.add(explanation_histograms(e));
  for (const Table& table : explanation_details(e)) page.add(table);
}

}  // namespace throng::report
