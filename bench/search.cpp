// Subcommand search: finding all pairs when all boxes move, compared with other libraries.
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#if defined(__unix__)
#include <unistd.h>
#endif

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/explain.hpp>
#include <throng/find_pairs.hpp>
#include <throng/finder.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/machine.hpp"
#include "apps/common/numbers.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/output_file.hpp"
#include "bench/cases.hpp"
#include "bench/competitors/competitors.hpp"
#include "bench/machine.hpp"
#include "bench/report.hpp"
#include "bench/search_rounds.hpp"
#include "bench/subcommands.hpp"
#include "bench/throng_methods.hpp"
#include "bench/validate.hpp"

namespace throng::bench {
namespace {

struct Arguments {
  std::vector<std::string> files, scenes, objects, competitors;
  OutputOptions output;
  std::vector<unsigned> threads;
  std::string isa, html;
  int rounds = 0;
  double budget = 780;
  bool validate = false, golden = false;
  bool quick = false, no_competitors = false, no_memory = false, json = false, details = false;
  int peak_of = -1;
};

std::size_t box_count(const std::string& text) {
  const std::uint64_t count = common::parse_count(text, "--objects");
  if (count < 1 || count > max_box_count) {
    throw common::Failure(fmt::format("--objects: found {}, wanted 1 to {}", count, max_box_count));
  }
  return static_cast<std::size_t>(count);
}

bool on_terminal(std::FILE* file) {
#if defined(__unix__)
  return isatty(fileno(file)) != 0;
#else
  (void)file;
  return false;
#endif
}

// Explains the time of a warmed search of the last frame.
Explanation explain(const Case& c) {
  const std::vector<Box>& frame = c.frames.back();
  Boxes boxes(frame.data(), c.objects);
  if (!c.worlds.empty()) boxes.filters.world = {c.worlds.data(), c.objects, sizeof(std::int32_t)};
  Options options;
  options.backend = Backend::cpu;
  Finder finder(options);
  const Result warmed = finder.find(boxes);
  if (!warmed.ok()) throw Error(warmed);
  return finder.explain(boxes);
}

bool is_named(const MethodInfo& method, const std::string& part) {
  return CLI::detail::to_lower(method.name).find(CLI::detail::to_lower(part)) != std::string::npos;
}

std::vector<MethodInfo> choose_methods(const Arguments& a) {
  std::vector<MethodInfo> all = throng_methods(a.isa == "all");
  if (a.no_competitors) return all;
  std::vector<MethodInfo> others = competitor_methods();
  for (const std::string& part : a.competitors) {
    const auto named = [&](const MethodInfo& m) { return is_named(m, part); };
    if (std::any_of(others.begin(), others.end(), named)) continue;
    std::string names;
    for (const MethodInfo& m : others) names += (names.empty() ? "" : "; ") + m.name;
    throw common::Failure(
        fmt::format("--competitors: found '{}', wanted a part of one of: {}", part, names));
  }
  for (MethodInfo& m : others) {
    const auto is_part = [&](const std::string& part) { return is_named(m, part); };
    if (a.competitors.empty() || std::any_of(a.competitors.begin(), a.competitors.end(), is_part))
      all.push_back(std::move(m));
  }
  return all;
}

// The results in about ten lines, and where the others are.
void print_summary(const Findings& f, const Arguments& a, double seconds) {
  const bool all_agree = disagreements(f).empty();
  report::Table table = summary_table(f, a.details ? f.measurements.size() : 12);
  const auto of_machine = [&](const std::string& wanted) {
    for (const auto& [name, value] : f.machine)
      if (name == wanted) return value;
    return std::string();
  };
  if (!a.no_competitors) {
    const std::string missing = of_machine("libraries not found");
    table.add_note(fmt::format("Libraries: {}{}{}.", of_machine("other libraries"),
                               missing.empty() ? "" : "; not found: ", missing));
    if (all_agree) table.add_note("All found the same pairs.");
  }
  table.add_note(fmt::format("Machine: {}, {} hardware threads. Measured in {:.0f} s.",
                             of_machine("processor"), of_machine("hardware threads"), seconds));
  if (std::strtod(of_machine("load when started").c_str(), nullptr) > 0.5)
    table.add_note("The machine was not idle: the times are not reliable.");
  fmt::print("{}", table.text());
  if (!a.details)
    fmt::print("--details prints all sizes, settings and thread counts; --html FILE draws them.\n");
}

std::size_t frames_for(std::size_t objects) {
  return objects <= 10000 ? 16 : objects <= 100000 ? 8 : 3;
}

int run(const Arguments& a) {
  if (a.golden) {
    print_golden();
    return 0;
  }
  if (a.validate) return validate(a.quick ? 10000 : 1000000) == 0 ? 0 : 1;
  std::vector<SceneChoice> scenes;
  for (const std::string& s : a.scenes) scenes.push_back(find_scene(s));
  for (const std::string& s : a.files) scenes.push_back(find_scene(s));
  std::vector<std::size_t> sizes;
  for (const std::string& n : a.objects) sizes.push_back(box_count(n));
  std::sort(sizes.begin(), sizes.end());

  std::vector<scenes::NamedFile> read;
  for (const std::string& file : a.files) read.push_back({"the boxes", file});
  scenes::check_outputs({{"--csv", a.output.csv}, {"--html", a.html}}, read);

  std::vector<MethodInfo> methods = choose_methods(a);
  if (a.peak_of >= 0) {  // the child process that measures memory
    // The parent passed the same options: the index is the same.
    const Case c = make_case(scenes.at(0), sizes.at(0), 2);
    fmt::print("{}\n", SearchRounds::peak_growth(methods.at(static_cast<std::size_t>(a.peak_of)), c,
                                                 a.threads.at(0)));
    return 0;
  }

  Settings settings;
  settings.rounds = a.rounds > 0 ? a.rounds : a.quick ? 3 : 5;
  settings.threads = a.threads;
  if (settings.threads.empty()) {
    settings.threads = {1};
    if (common::hardware_threads() > 1) settings.threads.push_back(common::hardware_threads());
  }
  settings.budget_seconds = a.budget;
  if (a.isa == "all") settings.method_options += " --isa all";
  if (a.no_competitors) settings.method_options += " --no-competitors";
  for (const std::string& part : a.competitors) {
    // Only letters and digits are passed to a shell; otherwise memory is not measured.
    const bool plain =
        std::all_of(part.begin(), part.end(), [](unsigned char ch) { return std::isalnum(ch); });
    if (!plain) settings.memory = false;
    settings.method_options += " --competitors " + part;
  }
  settings.memory = settings.memory && !a.no_memory && !a.quick;
  if (a.quick) settings.method_seconds = 0.1;
  const bool progress = on_terminal(stderr);
  if (progress)
    settings.progress = [](const std::string& text) {
      std::fprintf(stderr, "\r\033[K%s", text.substr(0, 78).c_str());
    };
  if (scenes.empty()) {
    if (a.quick)
      scenes = {find_scene("uniform"), find_scene("pile"), find_scene("mixed")};
    else
      scenes = all_scenes();
  }
  std::vector<std::size_t> scene_sizes = sizes;
  if (sizes.empty())
    scene_sizes = a.quick ? std::vector<std::size_t>{1000, 10000, 100000}
                          : std::vector<std::size_t>{1000, 10000, 100000, 1000000};

  Findings f;
  f.machine = machine_description();
  if (a.details || a.json || !a.output.csv.empty() || !a.html.empty())
    for (const unsigned t : settings.threads) f.bandwidth.push_back({t, copy_bandwidth(t)});
  if (a.details && !a.json) fmt::print("{}\n", machine_table(f).text());
  SearchRounds rounds(settings, std::move(methods));
  for (const SceneChoice& scene : scenes) {
    const bool file = scene.name.empty();
    for (std::size_t n : file ? std::vector<std::size_t>{0} : scene_sizes) {
      const Case c = make_case(scene, n, file ? 8 : frames_for(n));
      if (c.objects == 0) continue;
      if (file) {
        // Smaller parts first: a method that would take minutes for the whole file is left out.
        for (const std::size_t part : {c.objects / 64, c.objects / 8})
          if (part >= 100) rounds.measure(make_case(scene, part, 2));
      }
      std::vector<Measurement> measured = rounds.measure(c);
      f.measurements.insert(f.measurements.end(), measured.begin(), measured.end());
      if (!a.html.empty()) f.explanations[c.scene.label] = explain(c);
      if (progress) std::fprintf(stderr, "\r\033[K");
      if (a.details && !a.json) {
        fmt::print("{}\n", case_table(f, c.scene.label, c.objects).text());
        std::fflush(stdout);
      }
    }
  }
  if (a.json) {
    fmt::print("{}", json(f));
  } else {
    print_summary(f, a, rounds.seconds());
  }
  if (!a.output.csv.empty()) report::write_text(a.output.csv, csv(rows(f), a.output));
  if (!a.html.empty()) report::write_text(a.html, page(f).html());
  const std::vector<std::string> wrong = disagreements(f);
  for (const std::string& line : wrong) fmt::print(stderr, "DISAGREEMENT: {}\n", line);
  return wrong.empty() ? 0 : 1;
}

}  // namespace

int search_command(int argc, char** argv) {
  CLI::App app{
      "All pairs of boxes that all move, compared with other libraries, on scenes and on files.\n\n"
      "Examples:\n"
      "  throng-bench search --quick\n"
      "  throng-bench search --csv search.csv --html search.html\n"
      "  throng-bench search --scene uniform --objects 1K,100K --competitors baseline,embree\n"
      "  throng-bench search boxes.npy --isa all\n"
      "Exit status: 0 done, 1 libraries found different pairs, 2 bad usage or a bad file.",
      "throng-bench search"};
  Arguments a;
  app.add_option("files", a.files, "Boxes in .npy files, (n, 6) or (frames, n, 6)");
  app.add_option("--scene", a.scenes, "Scenes by name; all by default. May be given again");
  app.add_option("--objects", a.objects, "Numbers of boxes, such as 1K,10K,100K,1M")
      ->delimiter(',');
  app.add_option("--rounds", a.rounds, "Interleaved rounds; 5 by default")
      ->check(CLI::Range(1, 1000));
  app.add_option("--threads", a.threads, "Thread counts, such as 1,2; 1 and all by default")
      ->delimiter(',')
      ->check(CLI::Range(1, 1024));
  app.add_option("--competitors", a.competitors,
                 "Only baselines and other libraries whose name contains one of these words")
      ->delimiter(',');
  app.add_flag("--no-competitors", a.no_competitors, "Only Throng");
  app.add_option("--isa", a.isa, "'all': one measurement per instruction set")
      ->check(CLI::IsMember({"auto", "all"}));
  add_output_options(app, a.output);
  app.add_option("--html", a.html, "Write a page with tables and plots to this file");
  app.add_flag("--json", a.json, "Print one JSON object instead of tables");
  app.add_flag("--details", a.details,
               "Print a table per case: each library, setting and thread count");
  app.add_flag("--quick", a.quick, "Three scenes up to 100K boxes, in under a minute");
  app.add_flag("--no-memory", a.no_memory, "Do not measure peak memory");
  app.add_option("--budget", a.budget, "Seconds after which slow libraries are left out")
      ->check(CLI::Range(1.0, 1e6));
  app.add_flag(
      "--validate", a.validate,
      "No times: check that every thread count, instruction set and backend finds the pairs "
      "of a stored table (up to 10K boxes with --quick)");
  app.add_flag("--golden", a.golden, "Print that table for this build")->group("");
  app.add_option("--peak-of", a.peak_of)->group("");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? common::exit_done : common::exit_bad;
  }
  return run(a);
}

}  // namespace throng::bench
