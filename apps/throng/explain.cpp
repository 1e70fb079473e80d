// throng explain: why a search of these boxes costs what it does, and what would make it faster.
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <throng/explain.hpp>
#include <throng/find_pairs.hpp>
#include <throng/finder.hpp>

#include "apps/report/explanation.hpp"
#include "apps/report/page.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/input.hpp"

namespace throng::cli {
namespace {

using Json = nlohmann::ordered_json;

const char* help_text =
    R"(Searches the boxes as `throng pairs` does, once cold and once warmed, on the CPU. Prints the times, the
method and the reason for it, the methods and their prices, the number of tests, the memory, bars of the boxes by size and of the cells by
number of boxes, the largest boxes if sizes differ much, the cells with the most boxes, and what would make it
faster. For a file of several frames it explains the last one.

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
  json["visited"] = e.result.visited;
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
  json["cell_classes"] = Json::array();
  for (const auto& c : e.cell_classes) {
    json["cell_classes"].push_back(
        {{"from", c.from}, {"below", c.below}, {"cells", c.cells}, {"boxes", c.boxes}});
  }
  json["candidates"] = Json::array();
  for (const auto& c : e.candidates) {
    json["candidates"].push_back({{"algorithm", to_string(c.algorithm)},
                                  {"sweep_axis", c.sweep_axis},
                                  {"columns", c.columns},
                                  {"expected_ns", c.expected_ns}});
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

constexpr int text_width = 78;  // of the bars

std::string to_text(const Explanation& e) {
  std::string text = report::explanation_summary(e).text() + "\n";
  for (const report::Bars& bars : report::explanation_histograms(e))
    text += report::bar_text(bars, text_width) + "\n";
  for (const report::Table& table : report::explanation_details(e)) text += table.text() + "\n";
  return text + advice_text(e);
}

void write_page(const std::string& path, const std::string& name, const Explanation& e) {
  report::Page page(fmt::format("{}, explained", name));
  report::explain(page, e);
  report::write_text(path, page.html());
}

int run(const Arguments& arguments) {
  scenes::check_outputs({{"--html", arguments.html}}, files_of(arguments.input));
  const Options options = to_options(arguments.input, arguments.search);
  const Input input(arguments.input);
  const std::size_t last = input.frames() == 0 ? 0 : input.frames() - 1;
  Finder finder(options);
  const Boxes a = input.a().frame(last), b = input.b() ? input.b()->frame(last) : Boxes();
  const Result cold = input.b() ? finder.find(a, b) : finder.find(a);
  const common::HintOptions hint_options = to_hint_options(arguments.search);
  require_ok(cold, input, last, hint_options);
  Explanation explanation;
  try {
    explanation = input.b() ? finder.explain(a, b) : finder.explain(a);
  } catch (const Error& error) {
    require_ok(error.result(), input, last, hint_options);
  }
  if (!arguments.html.empty()) write_page(arguments.html, input.name(last), explanation);
  print(arguments.json ? to_json(explanation).dump(2) + "\n" : to_text(explanation));
  return exit_done;
}

}  // namespace

Run add_explain(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app =
      *program.add_subcommand("explain", "Explain the cost of a search, and how to reduce it");
  app.footer(help_text);
  add_input_arguments(app, arguments->input);
  add_search_arguments(app, arguments->search, AutoBackend::cpu_only);
  app.add_option("--html", arguments->html, "also write an HTML page with bar plots")
      ->type_name("PAGE.html");
  app.add_flag("--json", arguments->json, "print one JSON object");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
