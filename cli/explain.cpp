// throng explain: why a search of these boxes costs what it does, and what would make it faster.
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <throng/explain.hpp>
#include <throng/find_pairs.hpp>
#include <throng/finder.hpp>

#include "cli/commands.hpp"
#include "cli/console.hpp"
#include "cli/failure.hpp"
#include "cli/input.hpp"
#include "report/format.hpp"
#include "report/page.hpp"

namespace throng::cli {
namespace {

using Json = nlohmann::ordered_json;

const char* help_text =
    R"(Searches the boxes as `throng pairs` does, once cold and once warmed, by the CPU, and tells which algorithm
was chosen and why, how many boxes of which sizes there are and in how many cells each is, the tests per pair, the ten
largest boxes, the ten densest cells, the memory by part, and what would make it faster. Of a file of several frames, the
last one is explained.

Examples:
  throng explain boxes.npy
  throng explain robots.npy scene.npy --json
  throng explain boxes.npy --html explained.html
Exit status: 0 done, 2 bad input or an output that cannot be written.)";

struct Arguments {
  InputArguments input;
  SearchArguments search;
  std::string html;
  bool json = false;
};

std::string size_text(const Explanation::SizeClass& c) {
  if (c.below == 0) return "no extent";
  return c.from == c.below ? std::string("infinite") : fmt::format("{:g} to {:g}", c.from, c.below);
}

std::string place_text(const Box& b) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g})", b.lower.x, b.lower.y,
                     b.lower.z, b.upper.x, b.upper.y, b.upper.z);
}

report::Table summary(const Explanation& e) {
  const Plan& plan = e.result.plan;
  report::Table table("What was done", {"", ""});
  const auto row = [&](const char* what, const std::string& value) {
    table.add_row({what, value});
  };
  row("algorithm", fmt::format("{}, {}, {} thread{}", to_string(plan.algorithm),
                               to_string(plan.isa), plan.threads, plan.threads == 1 ? "" : "s"));
  row("because", plan.reason);
  row("boxes", report::format_count(e.boxes));
  row("inactive", report::format_count(e.result.inactive));
  row("pairs", report::format_count(e.result.found));
  if (e.cells > 0) {
    row("cells",
        fmt::format("{} ({} x {} x {}, swept along {}), {} with a box in them",
                    report::format_count(e.cells), plan.columns[0], plan.columns[1],
                    plan.columns[2], "xyz"[plan.sweep_axis], report::format_count(e.occupied)));
    row("cells a box", fmt::format("{:.3g}", static_cast<double>(e.entries) /
                                                 static_cast<double>(e.boxes ? e.boxes : 1)));
  } else {
    row("cells", "no one grid for all boxes");
  }
  row("tests", report::format_count(e.result.comparisons));
  row("tests a pair", fmt::format("{:.3g}", e.tests_per_pair));
  row("tests a box", fmt::format("{:.3g}", e.tests_per_box));
  const StageTimes& t = e.result.times;
  row("time", milliseconds(t.total_ms));
  row("  plan, bin, find, order",
      fmt::format("{}, {}, {}, {}", milliseconds(t.plan_ms), milliseconds(t.bin_ms),
                  milliseconds(t.find_ms), milliseconds(t.order_ms)));
  row("memory", report::format_bytes(static_cast<double>(e.memory_bytes)));
  return table;
}

std::vector<report::Table> details(const Explanation& e) {
  report::Table sizes("Sizes: the largest extent", {"from, to below", "boxes", "cells a box"});
  for (const auto& c : e.size_classes) {
    sizes.add_row({size_text(c), report::format_count(c.boxes),
                   e.cells > 0 ? fmt::format("{:.3g}", c.cells_per_box) : ""});
  }
  report::Table largest("The largest boxes", {"index", "set", "extent", "cells"});
  for (const auto& l : e.largest) {
    largest.add_row({std::to_string(l.index), l.in_second_set ? "second" : "first",
                     fmt::format("{:.4g}", l.extent),
                     e.cells > 0 ? report::format_count(l.cells) : ""});
  }
  report::Table densest("The densest cells", {"boxes", "where"});
  for (const auto& c : e.densest) {
    densest.add_row({report::format_count(c.boxes), place_text(c.bounds)});
  }
  report::Table memory("Memory", {"for", "bytes"});
  for (const auto& part : e.memory) memory.add_row({part.what, report::format_count(part.bytes)});
  std::vector<report::Table> tables;
  for (report::Table* table : {&sizes, &largest, &densest, &memory}) {
    if (table->rows() > 0) tables.push_back(std::move(*table));
  }
  return tables;
}

Json to_json(const Explanation& e) {
  Json json;
  const Plan& plan = e.result.plan;
  json["boxes"] = e.boxes;
  json["inactive"] = e.result.inactive;
  json["pairs"] = e.result.found;
  json["algorithm"] = to_string(plan.algorithm);
  json["isa"] = to_string(plan.isa);
  json["threads"] = plan.threads;
  json["reason"] = plan.reason;
  json["columns"] = plan.columns;
  json["sweep_axis"] = plan.sweep_axis;
  json["cells"] = e.cells;
  json["occupied"] = e.occupied;
  json["entries"] = e.entries;
  json["tests"] = e.result.comparisons;
  json["tests_per_pair"] = e.tests_per_pair;
  json["tests_per_box"] = e.tests_per_box;
  const StageTimes& t = e.result.times;
  json["stages_ms"] = {{"plan", t.plan_ms},
                       {"bin", t.bin_ms},
                       {"find", t.find_ms},
                       {"order", t.order_ms},
                       {"total", t.total_ms}};
  json["size_classes"] = Json::array();
  for (const auto& c : e.size_classes) {
    json["size_classes"].push_back({{"from", c.from},
                                    {"below", c.below},
                                    {"boxes", c.boxes},
                                    {"cells_per_box", c.cells_per_box}});
  }
  json["largest"] = Json::array();
  for (const auto& l : e.largest) {
    json["largest"].push_back({{"index", l.index},
                               {"set", l.in_second_set ? 2 : 1},
                               {"extent", l.extent},
                               {"cells", l.cells}});
  }
  json["densest"] = Json::array();
  for (const auto& c : e.densest) {
    const Vec3 &l = c.bounds.lower, &u = c.bounds.upper;
    json["densest"].push_back({{"boxes", c.boxes}, {"bounds", {l.x, l.y, l.z, u.x, u.y, u.z}}});
  }
  json["memory_bytes"] = e.memory_bytes;
  for (const auto& part : e.memory) json["memory"][part.what] = part.bytes;
  json["advice"] = e.advice;
  return json;
}

std::string advice_text(const Explanation& e) {
  if (e.advice.empty()) return "Nothing stands out that would make it faster.\n";
  std::string text = "What would make it faster\n";
  for (const std::string& line : e.advice) text += "- " + line + "\n";
  return text;
}

std::string to_text(const Explanation& e) {
  std::string text = summary(e).text() + "\n";
  for (const report::Table& table : details(e)) text += table.text() + "\n";
  return text + advice_text(e);
}

void write_page(const std::string& path, const std::string& name, const Explanation& e) {
  report::Page page(fmt::format("{}, explained", name));
  page.add(summary(e));
  page.heading("What would make it faster");
  if (e.advice.empty()) page.paragraph("Nothing stands out.");
  for (const std::string& line : e.advice) page.paragraph(line);
  page.heading("What the boxes are like");
  for (const report::Table& table : details(e)) page.add(table);
  report::write_text(path, page.html());
}

int run(const Arguments& arguments) {
  const Options options = to_options(arguments.input, arguments.search);
  const Input input(arguments.input);
  const std::size_t last = input.frames() == 0 ? 0 : input.frames() - 1;
  Finder finder(options);
  const Boxes a = input.a().frame(last), b = input.b() ? input.b()->frame(last) : Boxes();
  const Result cold = input.b() ? finder.find(a, b) : finder.find(a);
  require_ok(cold, input, last);
  Explanation explanation;
  try {
    explanation = input.b() ? finder.explain(a, b) : finder.explain(a);
  } catch (const Error& error) {
    throw Failure(error.what());
  }
  if (!arguments.html.empty()) write_page(arguments.html, input.name(last), explanation);
  say(arguments.json ? to_json(explanation).dump(2) + "\n" : to_text(explanation));
  return exit_done;
}

}  // namespace

Run add_explain(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand(
      "explain", "Tell why a search costs what it does, and what would help");
  app.footer(help_text);
  add_input_arguments(app, arguments->input);
  add_search_arguments(app, arguments->search);
  app.add_option("--html", arguments->html, "write it as a page, too")->type_name("PAGE.html");
  app.add_flag("--json", arguments->json, "print one JSON object");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
