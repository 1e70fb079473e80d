// throng-bench: Throng against what a user would pick instead.
#include <algorithm>
#include <cctype>
#include <cstdio>
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

#include "bench/cases.hpp"
#include "bench/library.hpp"
#include "bench/machine.hpp"
#include "bench/measure.hpp"
#include "bench/rivals.hpp"
#include "bench/tell.hpp"
#include "bench/validate.hpp"
#include "program/failure.hpp"
#include "program/machine.hpp"
#include "program/numbers.hpp"
#include "program/remedy.hpp"
#include "report/format.hpp"
#include "scene/output_file.hpp"

namespace throng::bench {
namespace {

struct Arguments {
  std::vector<std::string> files, scenes, objects, rivals;
  std::vector<unsigned> threads;
  std::string isa, csv, html;
  int rounds = 0;
  double budget = 780;
  bool validate = false, golden = false;
  bool quick = false, no_rivals = false, no_memory = false, json = false;
  int peak_of = -1;
};

std::size_t box_count(const std::string& text) {
  const std::uint64_t count = program::parse_count(text, "--objects");
  if (count < 1 || count > max_box_count) {
    throw program::Failure(
        fmt::format("--objects: found {}, wanted 1 to {}", count, max_box_count));
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

// Why Throng takes what it takes, warmed, for the last frame.
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

bool is_named(const Entry& rival, const std::string& part) {
  return CLI::detail::to_lower(rival.name).find(CLI::detail::to_lower(part)) != std::string::npos;
}

std::vector<Entry> choose_entries(const Arguments& a) {
  std::vector<Entry> all = library_entries(a.isa == "all");
  if (a.no_rivals) return all;
  std::vector<Entry> rivals = rival_entries();
  for (const std::string& part : a.rivals) {
    const auto named = [&](const Entry& e) { return is_named(e, part); };
    if (std::any_of(rivals.begin(), rivals.end(), named)) continue;
    std::string names;
    for (const Entry& e : rivals) names += (names.empty() ? "" : "; ") + e.name;
    throw program::Failure(
        fmt::format("--rivals: found '{}', wanted a part of one of: {}", part, names));
  }
  for (Entry& e : rivals) {
    const auto is_part = [&](const std::string& part) { return is_named(e, part); };
    if (a.rivals.empty() || std::any_of(a.rivals.begin(), a.rivals.end(), is_part))
      all.push_back(std::move(e));
  }
  return all;
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

  std::vector<scene::NamedFile> read;
  for (const std::string& file : a.files) read.push_back({"the boxes", file});
  scene::check_outputs({{"--csv", a.csv}, {"--html", a.html}}, read);

  std::vector<Entry> entries = choose_entries(a);
  if (a.peak_of >= 0) {  // the child that measures memory
    // Numbered as the parent numbers them, which chose with the same options.
    const Case c = make_case(scenes.at(0), sizes.at(0), 2);
    fmt::print("{}\n", Bench::peak_growth(entries.at(static_cast<std::size_t>(a.peak_of)), c,
                                          a.threads.at(0)));
    return 0;
  }

  Settings settings;
  settings.rounds = a.rounds > 0 ? a.rounds : a.quick ? 3 : 5;
  settings.threads = a.threads;
  if (settings.threads.empty()) {
    settings.threads = {1};
    if (program::hardware_threads() > 1) settings.threads.push_back(program::hardware_threads());
  }
  settings.budget_seconds = a.budget;
  if (a.isa == "all") settings.entry_options += " --isa all";
  if (a.no_rivals) settings.entry_options += " --no-rivals";
  for (const std::string& r : a.rivals) {
    // Only letters and digits are passed on to a shell; memory is not measured otherwise.
    const bool plain =
        std::all_of(r.begin(), r.end(), [](unsigned char ch) { return std::isalnum(ch); });
    if (!plain) settings.memory = false;
    settings.entry_options += " --rivals " + r;
  }
  settings.memory = settings.memory && !a.no_memory && !a.quick;
  if (a.quick) settings.contender_seconds = 0.1;
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
  for (const unsigned t : settings.threads) f.bandwidth.push_back({t, copy_bandwidth(t)});
  if (!a.json) fmt::print("{}\n", machine_table(f).text());
  Bench bench(settings, std::move(entries));
  for (const SceneChoice& scene : scenes) {
    const bool file = scene.name.empty();
    for (std::size_t n : file ? std::vector<std::size_t>{0} : scene_sizes) {
      const Case c = make_case(scene, n, file ? 8 : frames_for(n));
      if (c.objects == 0) continue;
      if (file) {
        // Smaller parts first, so that who would take minutes on the whole is found out.
        for (const std::size_t part : {c.objects / 64, c.objects / 8})
          if (part >= 100) bench.measure(make_case(scene, part, 2));
      }
      std::vector<Row> rows = bench.measure(c);
      f.rows.insert(f.rows.end(), rows.begin(), rows.end());
      if (!a.html.empty()) f.explanations[c.scene.label] = explain(c);
      if (progress) std::fprintf(stderr, "\r\033[K");
      if (!a.json) {
        fmt::print("{}\n", case_table(f, c.scene.label, c.objects).text());
        std::fflush(stdout);
      }
    }
  }
  if (a.json) {
    fmt::print("{}", json(f));
  } else {
    fmt::print("{}\n", summary_table(f).text());
    if (yardstick_table(f).rows() > 0) fmt::print("{}\n", yardstick_table(f).text());
    fmt::print("{:.0f} s in all.\n", bench.seconds());
  }
  if (!a.csv.empty()) report::write_text(a.csv, all_rows(f).csv());
  if (!a.html.empty()) report::write_text(a.html, page(f).html());
  const std::vector<std::string> wrong = disagreements(f);
  for (const std::string& line : wrong) fmt::print(stderr, "DISAGREEMENT: {}\n", line);
  return wrong.empty() ? 0 : 1;
}

void fail(const std::string& what) {
  std::fflush(stdout);
  fmt::print(stderr, "throng-bench: {}\n", what);
}

}  // namespace
}  // namespace throng::bench

int main(int argc, char** argv) {
  using namespace throng::bench;
  CLI::App app{
      "Throng against what a user would pick instead, on scenes and on files.\n\n"
      "Examples:\n"
      "  throng-bench --quick\n"
      "  throng-bench --csv results.csv --html results.html\n"
      "  throng-bench --scene uniform --objects 1K,100K --rivals plain,embree\n"
      "  throng-bench boxes.npy --isa all\n"
      "Exit status: 0 done, 1 contenders found different pairs, 2 bad usage or a bad file.",
      "throng-bench"};
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
  app.add_option("--rivals", a.rivals, "Only those whose name contains one of these words")
      ->delimiter(',');
  app.add_flag("--no-rivals", a.no_rivals, "Only Throng's own rows");
  app.add_option("--isa", a.isa, "'all': a row for each instruction set")
      ->check(CLI::IsMember({"auto", "all"}));
  app.add_option("--csv", a.csv, "Write all rows to this file");
  app.add_option("--html", a.html, "Write a page with tables and plots to this file");
  app.add_flag("--json", a.json, "Print one JSON object instead of tables");
  app.add_flag("--quick", a.quick, "Three scenes up to 100K boxes, in under a minute");
  app.add_flag("--no-memory", a.no_memory, "Do not measure peak memory");
  app.add_option("--budget", a.budget, "Seconds after which slow rivals are left out")
      ->check(CLI::Range(1.0, 1e6));
  app.add_flag(
      "--validate", a.validate,
      "No times: whether every thread count, instruction set and backend finds the very pairs of "
      "a table that is kept (up to 10K boxes with --quick)");
  app.add_flag("--golden", a.golden, "Print that table as it is here")->group("");
  app.add_option("--peak-of", a.peak_of)->group("");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    return run(a);
  } catch (const throng::Error& e) {
    fail(throng::program::failure_text(e.result(), {}));
  } catch (const std::exception& e) {
    fail(e.what());
  }
  return 2;
}
