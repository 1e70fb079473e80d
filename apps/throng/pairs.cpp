// throng pairs: finds the pairs in files of boxes; prints their count and the times.
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "apps/common/numbers.hpp"
#include "apps/report/format.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/report_json.hpp"
#include "apps/throng/search.hpp"

namespace throng::cli {
namespace {

using Json = nlohmann::ordered_json;

const char* help_text =
    R"(Prints the number of boxes and pairs, a checksum that does not depend on the order of the pairs,
and times. Every frame is searched once cold, which also writes the output, then --repeat times
warmed; total_ms is the median of the warmed runs into a reused buffer, without reading the
file and the checksum. With --memory pairs are written as they are found. Boxes that do not fit
are read in slabs, once, through a temporary file of about 30 bytes per box and 4 per filter, in $TMPDIR
or the output's folder. For a file of several frames it prints sums over the frames, with --json also
each frame; the output holds their pairs one after another.

Examples:
  throng pairs boxes.npy
  throng pairs boxes.npy -o pairs.npy --order canonical
  throng pairs boxes.npy --json --repeat 21 --threads 2
  throng pairs robots.npy scene.npy --margin 0.01
  throng pairs worlds.npy --world worlds-world.npy
  throng pairs huge.npy --memory 256M -o pairs.npy
Exit status: 0 done, 2 bad input or an output that cannot be written.)";

struct Arguments {
  InputArguments input;
  SearchArguments search;
  std::string output, memory;
  std::size_t repeat = 1;
  bool json = false;
};

Json to_json(const SearchReport& report) {
  const FrameReport sum = report.sum();
  Json json;
  json["n"] = report.count;
  if (report.count_b) json["n_b"] = *report.count_b;
  json["pairs"] = sum.pairs;
  json["checksum"] = hex(sum.checksum);
  json["inactive"] = sum.inactive;
  add_plan_and_times(json, report.plan, sum.total_ms, report.first_ms, sum.stages);
  json["peak_bytes"] = report.peak_bytes ? Json(*report.peak_bytes) : Json(nullptr);
  json["comparisons"] = sum.comparisons;
  json["visited"] = sum.visited;
  json["plan"] = {{"reason", report.plan.reason},
                  {"sweep_axis", report.plan.sweep_axis},
                  {"columns", report.plan.columns},
                  {"expected_ms", report.plan.expected_ns * 1e-6}};
  if (report.streamed) {
    json["streamed"] = {{"slabs", report.streamed->slabs},
                        {"searches", report.streamed->searches},
                        {"scratch_bytes", report.streamed->scratch_bytes},
                        {"read_ms", report.streamed->read_ms}};
  }
  if (report.frames.size() > 1) {
    for (const FrameReport& frame : report.frames) {
      json["frames"].push_back({{"pairs", frame.pairs},
                                {"checksum", hex(frame.checksum)},
                                {"total_ms", frame.total_ms}});
    }
  }
  return json;
}

std::string to_text(const SearchReport& report, const Arguments& arguments) {
  const FrameReport sum = report.sum();
  const InputArguments& input = arguments.input;
  const double n = static_cast<double>(report.count + report.count_b.value_or(0));
  const double frames = static_cast<double>(report.frames.size());
  std::string text = fmt::format("{}: {} boxes", input.a, report::format_count(report.count));
  if (report.count_b)
    text += fmt::format("; {}: {}", input.b, report::format_count(*report.count_b));
  if (frames > 1) text += fmt::format("; {:.0f} frames", frames);
  text += fmt::format("\npairs     {}", report::format_count(sum.pairs));
  if (n > 0) text += fmt::format("  ({:.2f} per box)", static_cast<double>(sum.pairs) / n / frames);
  text += fmt::format("\nchecksum  {}\ninactive  {}\n", hex(sum.checksum),
                      report::format_count(sum.inactive));
  text += fmt::format("plan      {}, {}, {} thread{}: {}\n", to_string(report.plan.algorithm),
                      to_string(report.plan.isa), report.plan.threads,
                      report.plan.threads == 1 ? "" : "s", report.plan.reason);
  if (report.streamed) {
    text += fmt::format(
        "streamed  in {} slabs, {} searches; at most {} on disk\n"
        "time      {}  (from file to pairs, once)\n  read    {}\n  find    {}\n",
        report.streamed->slabs, report.streamed->searches,
        report::format_bytes(static_cast<double>(report.streamed->scratch_bytes)),
        milliseconds(sum.total_ms), milliseconds(report.streamed->read_ms),
        milliseconds(sum.stages.find_ms));
  } else {
    text += fmt::format("time      {}{}  (median of {} warmed run{}; the first call took {})\n",
                        milliseconds(sum.total_ms), frames > 1 ? " for all frames" : "",
                        arguments.repeat, arguments.repeat == 1 ? "" : "s",
                        milliseconds(report.first_ms));
    text +=
        fmt::format("  plan    {}\n  bin     {}\n  find    {}\n", milliseconds(sum.stages.plan_ms),
                    milliseconds(sum.stages.bin_ms), milliseconds(sum.stages.find_ms));
  }
  if (arguments.search.order == "canonical") {
    text += fmt::format("  order   {}\n", milliseconds(sum.stages.order_ms));
  }
  text += fmt::format("compared  {} candidates\n", report::format_count(sum.comparisons));
  if (report.peak_bytes) {
    text += fmt::format("memory    {} at most\n",
                        report::format_bytes(static_cast<double>(*report.peak_bytes)));
  }
  if (!arguments.output.empty()) text += fmt::format("pairs are in {}\n", arguments.output);
  return text;
}

int run(const Arguments& arguments) {
  scenes::check_outputs({{"-o", arguments.output}}, files_of(arguments.input));
  SearchRequest request;
  request.options = to_options(arguments.input, arguments.search);
  request.hint_options = to_hint_options(arguments.search);
  request.hint_options.memory = true;
  request.repeat = arguments.repeat;
  request.output = arguments.output;
  if (!arguments.memory.empty()) {
    request.options.memory_cap_bytes = common::parse_bytes(arguments.memory, "--memory");
    if (request.options.memory_cap_bytes == 0) {
      throw Failure("--memory: found 0, wanted at least one byte");
    }
  }
  const SearchReport report = request.options.memory_cap_bytes != 0
                                  ? run_capped_search(arguments.input, request)
                                  : run_search(Input(arguments.input), request);
  print(arguments.json ? to_json(report).dump(2) + "\n" : to_text(report, arguments));
  return exit_done;
}

}  // namespace

Run add_pairs(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("pairs", "Find the overlapping pairs of files of boxes");
  app.footer(help_text);
  add_input_arguments(app, arguments->input);
  arguments->input.refuses_inverted = true;
  app.add_option_function<std::string>(
         "--inverted",
         [arguments](const std::string& v) { arguments->input.refuses_inverted = v == "refuse"; },
         "a box with lower > upper: refuse (the default), or inactive: an empty slot")
      ->check(CLI::IsMember({"refuse", "inactive"}).description(""))
      ->type_name("refuse|inactive");
  add_search_arguments(app, arguments->search);
  app.add_option("-o,--output", arguments->output, "write the pairs: uint32 of shape (pairs, 2)")
      ->type_name("PAIRS.npy");
  app.add_option_function<std::string>(
         "--repeat", common::count_into(arguments->repeat, "--repeat", 1, 1000000),
         "number of warmed runs for the median (1)")
      ->type_name("K");
  app.add_option("--memory", arguments->memory,
                 "memory cap for boxes, workspace and pairs, e.g. 64M")
      ->type_name("BYTES");
  app.add_flag("--json", arguments->json, "print one JSON object");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
