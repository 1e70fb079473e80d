// throng replay: repeats a program's captured calls on every backend and compares them with a
// double loop.
#include "apps/throng/replay.hpp"

#include <cstring>
#include <memory>
#include <new>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/find_pairs.hpp>
#include <throng/finder.hpp>

#include "apps/report/format.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/comparison.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"

namespace throng::cli {
namespace {

using capture::Form;
using report::format_count;
using scenes::Capture;
using scenes::CapturedAnswer;
using scenes::CapturedCall;

const char* help_text =
    R"(Repeats the calls of a capture, a file made by Options::capture or the environment variable
THRONG_CAPTURE=FOLDER. A search runs on every available backend, algorithm and instruction set, with
several numbers of threads; the calls of a BroadPhase run in sequence. Their results are compared
with a separate double loop and with the captured results. For the first difference both boxes are
printed, in decimal and exactly. Above about 450,000 boxes the double loop needs --full; without it
the algorithms are compared with each other.

Examples:
  mkdir captures && THRONG_CAPTURE=captures ./my-program
  throng replay captures/throng-000645f3a1b2c3d4-000.capture
  throng replay captures/throng-000645f3a1b2c3d4-000.capture --json
Exit status: 0 all agree, 1 a result differs, 2 bad input.)";

struct Arguments {
  std::string file;
  bool json = false, full = false;
};

const char* const form_names[] = {"growing", "caller's buffer", "consumer"};

void report_options(const Capture& capture, ReplayReport& report) {
  const Options& o = capture.options;
  report.text += fmt::format(
      "written by throng {}; backend {}, algorithm {}, {} order, isa {}, {} threads, margin {}, "
      "NaN "
      "{}{}{}\n",
      capture.library, to_string(o.backend), to_string(o.algorithm),
      o.order == Order::canonical ? "canonical" : "any", to_string(o.isa),
      o.threads ? fmt::to_string(o.threads) : "all", o.margin,
      o.nan == NanPolicy::refuse ? "refused" : "inactive",
      capture.executor ? fmt::format(", an executor of {}", capture.executor) : std::string(),
      capture.has_memory_resource ? ", a memory resource" : "");
  report.json["library"] = capture.library;
  report.json["options"] = {{"backend", to_string(o.backend)},
                            {"algorithm", to_string(o.algorithm)},
                            {"order", o.order == Order::canonical ? "canonical" : "any"},
                            {"isa", to_string(o.isa)},
                            {"threads", o.threads},
                            {"margin", o.margin}};
}

std::string answer_text(const CapturedAnswer& a) {
  if (a.status != Status::ok && a.status != Status::buffer_too_small)
    return fmt::format("{}", to_string(a.status));
  return fmt::format("{}, {} pairs, checksum {:016x}", to_string(a.status), format_count(a.found),
                     a.checksum);
}

// The captured call repeated here.
void repeat(const Capture& capture, const Boxes& a, const Boxes* b, ReplayReport& report) {
  const CapturedCall& call = capture.calls[0];
  Finder finder(capture.options);
  // The file does not contain the buffer, only its capacity: limit what is allocated.
  constexpr std::uint64_t max_capacity = std::uint64_t{1} << 26;
  const bool too_large = call.capacity > max_capacity;
  const Form form = too_large ? Form::growing : static_cast<Form>(call.form);
  const auto capacity = static_cast<std::size_t>(too_large ? 0 : call.capacity);
  const FormRun run = run_form(finder, a, b, form, capacity);
  const Result& r = run.result;
  std::string line;
  if (r.ok() || r.status == Status::buffer_too_small) {
    line = fmt::format("{}, {} pairs", to_string(r.status), format_count(r.found));
  } else {
    line = fmt::format("{}: {}", to_string(r.status), r.message);
  }
  report.json["repeated"] = {{"status", to_string(r.status)}, {"pairs", r.found}};
  bool same = true;
  if (call.answer && !too_large && r.status != Status::unsupported_isa &&
      r.status != Status::no_device) {
    same = r.status == call.answer->status && r.found == call.answer->found &&
           r.first_invalid == call.answer->first_invalid &&
           r.invalid_count == call.answer->invalid_count;
    // A signal, a stop or memory shortage of the captured call need not recur.
    const Status was = call.answer->status;
    if (was == Status::stopped || was == Status::out_of_memory || was == Status::device_error ||
        was == Status::memory_cap_too_small)
      same = true;
  }
  report.text += fmt::format("again     {}{}\n", line, same ? "" : "  DIFFERS");
  if (!same) report.differs = true;
}

void compare_answer(const CapturedAnswer& answer, const ExpectedPairs& expected_pairs,
                    const char* by, ReplayReport& report) {
  if (answer.status != Status::ok && answer.status != Status::buffer_too_small) return;
  const std::uint64_t reference =
      pair_checksum(expected_pairs.pairs().data(), expected_pairs.pairs().size());
  const bool whole = answer.written == answer.found;
  const bool agrees = answer.found == expected_pairs.pairs().size() &&
                      answer.inactive == expected_pairs.inactive() &&
                      (!whole || answer.checksum == reference);
  report.json["capture_agrees"] = agrees;
  report.text +=
      fmt::format("the captured result {} {}\n", agrees ? "agrees with" : "DIFFERS from", by);
  if (!agrees) report.differs = true;
}

void report_first_difference(const Comparison::First& first, const Boxes& a, const Boxes* b,
                             ReplayReport& report) {
  const Pair pair = first.difference.pair;
  report.text += fmt::format("first difference: {}: {} ({}, {})\n", first.run,
                             first.difference.what, pair.first, pair.second);
  const Boxes& second = b ? *b : a;
  nlohmann::ordered_json json = {
      {"run", first.run}, {"what", first.difference.what}, {"pair", {pair.first, pair.second}}};
  if (pair.first < a.size() && pair.second < second.size()) {
    const std::string one = box_text(a[pair.first]), two = box_text(second[pair.second]);
    report.text += fmt::format("  box {}\n{}  box {}\n{}", pair.first, one, pair.second, two);
    json["boxes"] = {one, two};
  }
  report.json["first_difference"] = json;
}

void replay_find(const Capture& capture, const ReplayLimits& limits, ReplayReport& report) {
  const CapturedCall& call = capture.calls[0];
  const Boxes a = call.sets[0].view();
  Boxes second;
  const Boxes* b = nullptr;
  if (call.sets.size() == 2) {
    second = call.sets[1].view();
    b = &second;
  }
  report.text += fmt::format("{} boxes{}{}, in the form '{}'\n", format_count(a.size()),
                             b ? " and " + format_count(b->size()) : "",
                             a.is_flat() ? ", flat" : "", form_names[call.form]);
  report.json["n"] = a.size();
  if (b) report.json["n_b"] = b->size();
  report.text += "captured  " +
                 (call.answer ? answer_text(*call.answer)
                              : std::string("no result: the call did not return, or the file was "
                                            "truncated after its boxes")) +
                 "\n";
  report.json["captured"] = nullptr;
  if (call.answer) {
    report.json["captured"] = {{"status", to_string(call.answer->status)},
                               {"pairs", call.answer->found},
                               {"checksum", fmt::format("{:016x}", call.answer->checksum)}};
  }
  repeat(capture, a, b, report);
  Options options = capture.options;
  options.memory_cap_bytes = 0;
  options.isa = Isa::automatic;
  options.backend = Backend::cpu;
  Finder probe(options);
  const Result probed = b ? probe.find(a, *b) : probe.find(a);
  if (!probed.ok()) {
    report.text += fmt::format("these boxes are refused: {}\n", probed.message);
    report.json["refused"] = probed.message;
    return;
  }
  const char* by = nullptr;
  ExpectedPairs expected_pairs = make_expected_pairs(a, b, options.margin, limits, by);
  report.text += fmt::format(
      "expected  {} pairs, checksum {:016x}, by {}\n", format_count(expected_pairs.pairs().size()),
      pair_checksum(expected_pairs.pairs().data(), expected_pairs.pairs().size()), by);
  report.json["expected"] = {{"pairs", expected_pairs.pairs().size()}, {"by", by}};
  if (call.answer) compare_answer(*call.answer, expected_pairs, by, report);
  report.text += Comparison::head();
  Comparison comparison(a, b, options, expected_pairs);
  report.json["rows"] = nlohmann::ordered_json::array();
  const std::size_t differing = comparison.run(limits.full, [&](const Comparison::Row& row) {
    report.text += row.text();
    report.json["rows"].push_back({{"backend", to_string(row.backend)},
                                   {"algorithm", to_string(row.algorithm)},
                                   {"isa", to_string(row.isa)},
                                   {"runs", row.runs},
                                   {"skipped", row.skipped},
                                   {"agrees", row.problems.empty()}});
  });
  if (differing) report.differs = true;
  if (comparison.first()) report_first_difference(*comparison.first(), a, b, report);
}

int run(const Arguments& arguments) {
  const Capture capture = scenes::read_capture(arguments.file);
  ReplayLimits limits;
  limits.full = arguments.full;
  limits.max_tests = arguments.full ? 1e300 : 1e11;
  ReplayReport report;
  report.json["file"] = arguments.file;
  report.json["agrees"] = nullptr;
  report.text = arguments.file + ": ";
  report_options(capture, report);
  try {
    if (capture.is_finder())
      replay_find(capture, limits, report);
    else
      replay_broad_phase(capture, limits, report);
  } catch (const std::bad_alloc&) {
    throw Failure(
        fmt::format("{}: out of memory; the double loop keeps {} bytes a pair, twice over",
                    arguments.file, sizeof(Pair)));
  }
  report.json["agrees"] = !report.differs;
  report.text += report.differs ? "results DIFFER\n" : "all agree\n";
  print(arguments.json ? report.json.dump(2) + "\n" : report.text);
  return report.differs ? exit_differs : exit_done;
}

}  // namespace

std::string box_text(const Box& box) {
  const auto corner = [](const char* name, const Vec3& v) {
    return fmt::format("    {}  {:.9g} {:.9g} {:.9g}  =  {:a} {:a} {:a}\n", name, v.x, v.y, v.z,
                       v.x, v.y, v.z);
  };
  return corner("lower", box.lower) + corner("upper", box.upper);
}

ExpectedPairs make_expected_pairs(const Boxes& a, const Boxes* b, float margin,
                                  const ReplayLimits& limits, const char*& by) {
  const double n = static_cast<double>(a.size());
  if ((b ? n * static_cast<double>(b->size()) : 0.5 * n * n) <= limits.max_tests) {
    by = "the double loop";
    Progress progress("double loop: box", a.size());
    return {a, b, margin, [&](std::size_t done) { progress.at(done); }};
  }
  by = "the grid alone (too many boxes for a double loop without --full)";
  Options options;
  options.backend = Backend::cpu;
  options.algorithm = Algorithm::grid;
  options.isa = Isa::scalar;
  options.threads = 1;
  options.order = Order::canonical;
  options.nan = NanPolicy::inactive;
  options.margin = margin;
  LoopResult reference;
  const Result r =
      b ? find_pairs(a, *b, reference.pairs, options) : find_pairs(a, reference.pairs, options);
  if (!r.ok()) throw Failure(fmt::format("the search to compare with failed: {}", r.message));
  reference.inactive = r.inactive;
  return {a.size(), std::move(reference)};
}

Run add_replay(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("replay", "Run captured calls again and compare");
  app.footer(help_text);
  app.add_option("FILE", arguments->file, "a capture: see THRONG_CAPTURE below")
      ->required()
      ->type_name("FILE.capture");
  app.add_flag("--json", arguments->json, "print one JSON object");
  app.add_flag("--full", arguments->full, "everything, whatever it takes");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
