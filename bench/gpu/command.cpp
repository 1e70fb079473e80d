// Subcommand gpu: the CUDA backend, boxes and pairs in device memory.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <throng/cuda.hpp>

#include "apps/report/page.hpp"
#include "bench/gpu/gpu.hpp"
#include "bench/gpu/session.hpp"
#include "bench/subcommands.hpp"

namespace throng::bench::gpu {
namespace {

struct Arguments {
  std::vector<std::string> parts, files;
  std::string expect, cpu_answers;
  OutputOptions output;
  std::size_t least = 0, most = 100000000;
  double budget = 1.0;
  unsigned threads = 0;
  bool device = false;
};

const std::vector<std::string> all_parts = {"scaling", "scenes",   "stages",  "crossover",
                                            "bodies",  "tracking", "queries", "device"};
// Those that have no list of cases.
bool has_own_cases(const std::string& part) {
  return part == "device" || part == "bodies" || part == "tracking" || part == "queries";
}

void describe_device() {
  int ordinal = 0, driver = 0;
  cudaDeviceProp p{};
  need(cudaGetDevice(&ordinal));
  need(cudaGetDeviceProperties(&p, ordinal));
  need(cudaDriverGetVersion(&driver));
  std::printf(
      "%s: %d multiprocessors, compute capability %d.%d, %.1f GiB, %d MiB of L2, CUDA %d.%d "
      "by the driver\n\n",
      p.name, p.multiProcessorCount, p.major, p.minor,
      static_cast<double>(p.totalGlobalMem) / (1 << 30), p.l2CacheSize >> 20, driver / 1000,
      driver % 1000 / 10);
}

std::vector<Case> cases_for(const Arguments& a) {
  std::vector<Case> all = cases_of_files(a.files);
  bool scaling = false;
  for (const std::string& part : a.parts) {
    if (has_own_cases(part)) continue;
    scaling = scaling || part == "scaling";
    for (const Case& c : cases_of(part, a.most)) all.push_back(c);
    // The scenes are compared with uniform boxes.
    if (part == "scenes" && !scaling)
      for (Case c : cases_of("scaling", std::min<std::size_t>(a.most, 10000000)))
        if (c.objects >= 100000) {
          c.experiment = "scenes";
          c.canonical = false;
          all.push_back(c);
        }
  }
  all.erase(std::remove_if(all.begin(), all.end(),
                           [&](const Case& c) { return !c.scene.empty() && c.objects < a.least; }),
            all.end());
  return all;
}

int report_wrong(const Session& s, bool expected) {
  if (expected)
    std::printf(
        "%zu answers compared with those expected, %zu differ or are impossible; %zu are "
        "not in the file.\n",
        s.checked, s.wrong.size(), s.unknown);
  for (const std::string& line : s.wrong) std::fprintf(stderr, "DISAGREEMENT: %s\n", line.c_str());
  if (expected && s.checked == 0) {
    std::fprintf(stderr, "no case is in the file of answers\n");
    return 1;
  }
  return s.wrong.empty() ? 0 : 1;
}

// Writes the answers of the CPU to a file, and compares them with `expected` if it is not null.
int answer(const Arguments& a, const Answers* expected) {
  Answers answers;
  Session s;
  for (const Case& c : cases_for(a)) {
    if (answers.find(c.label, c.objects, 0)) continue;  // in another part
    answer_by_cpu(c, a.threads, answers);
    for (std::size_t f = 0; f < c.frames; ++f) {
      const Answer* got = answers.find(c.label, c.objects, f);
      std::printf("%s, %zu boxes, frame %zu: %llu pairs, checksum %s\n", c.label.c_str(), c.objects,
                  f, static_cast<unsigned long long>(got->pairs), hex(got->checksum).c_str());
      if (!expected) continue;
      const Answer* want = expected->find(c.label, c.objects, f);
      s.unknown += want == nullptr;
      s.checked += want != nullptr;
      if (want && !(*want == *got))
        s.wrong.push_back(c.label + ", " + std::to_string(c.objects) + ", frame " +
                          std::to_string(f) + ": expected " + std::to_string(want->pairs) + ", " +
                          hex(want->checksum));
    }
    std::fflush(stdout);
  }
  report::write_text(a.cpu_answers, answers.csv());
  return report_wrong(s, expected != nullptr);
}

int run(Arguments a) {
  if (a.parts.empty() && a.files.empty()) a.parts = all_parts;
  for (const std::string& part : a.parts)
    if (!has_own_cases(part)) (void)cases_of(part, 0);  // throws if there is no such part
  Answers expected;
  if (!a.expect.empty()) expected = Answers::read(a.expect);
  if (!a.cpu_answers.empty()) return answer(a, a.expect.empty() ? nullptr : &expected);

  const Result gpu = cuda::available();
  if (!gpu.ok()) {
    std::fprintf(stderr, "throng-bench gpu: %s. --cpu-answers needs no GPU.\n", gpu.message);
    return 2;
  }
  Session s;
  s.budget_ms = 1000 * a.budget;
  s.expected = a.expect.empty() ? nullptr : &expected;
  describe_device();
  if (a.device) return 0;
  const auto show = [&](const std::string& title, std::size_t from) {
    const std::vector<Measurement> fresh(s.measurements.begin() + static_cast<std::ptrdiff_t>(from),
                                         s.measurements.end());
    std::printf("%s\n", table(title, fresh).text().c_str());
    std::fflush(stdout);
    // The rows so far, in case a later part fails.
    if (!a.output.csv.empty())
      report::write_text(a.output.csv, csv(rows(s.measurements), a.output));
  };
  // An error in one case does not end the others.
  const auto guarded = [&](const std::string& what, const auto& f) {
    const std::size_t from = s.measurements.size();
    try {
      f();
    } catch (const std::exception& e) {
      s.wrong.push_back(what + ": " + e.what());
    }
    if (s.measurements.size() > from) show(what, from);
  };
  for (const std::string& part : a.parts) {
    if (part == "device") guarded("device", [&] { measure_device_limits(s, a.most); });
    if (part == "bodies") guarded("bodies", [&] { measure_bodies(s, a.most); });
    if (part == "tracking") guarded("tracking", [&] { measure_tracking(s, a.least, a.most); });
    if (part == "queries") guarded("queries", [&] { measure_queries(s, a.least, a.most); });
  }
  for (const Case& c : cases_for(a)) {
    // A recording that is not in the file is compared with what the CPU finds now.
    if (s.expected && c.scene.empty() && !expected.find(c.label, c.objects, 0))
      guarded(c.label + ", by the CPU", [&] { answer_by_cpu(c, a.threads, expected); });
    guarded(c.experiment + ": " + c.label + ", " + std::to_string(c.objects),
            [&] { c.experiment == "stages" ? measure_stages(c, s) : measure_search(c, s); });
  }
  return report_wrong(s, s.expected != nullptr);
}

}  // namespace
}  // namespace throng::bench::gpu

namespace throng::bench {

int gpu_command(int argc, char** argv) {
  CLI::App app{
      "The CUDA backend, boxes and pairs in device memory, by replays of a graph.\n\n"
      "Examples:\n"
      "  throng-bench gpu --part scaling --csv scaling.csv --expect answers.csv\n"
      "  throng-bench gpu --part scenes --part stages --most 1000000\n"
      "  throng-bench gpu --files cloth-ball.npy armadillo-rollers.npy\n"
      "  throng-bench gpu --cpu-answers answers.csv --most 10000000\n"
      "Exit status: 0 done, 1 answers differ, 2 bad usage, a bad file, or no GPU.",
      "throng-bench gpu"};
  gpu::Arguments a;
  app.add_option("--part", a.parts,
                 "scaling, scenes, stages, crossover, bodies, tracking, queries or device; all by "
                 "default. May be given again");
  app.add_option("--files", a.files, "Recorded boxes in .npy files, each frame");
  app.add_option("--least", a.least, "Leave out cases with fewer boxes");
  app.add_option("--most", a.most, "Leave out cases with more boxes");
  app.add_option("--budget", a.budget, "Seconds of replays per measurement")
      ->check(CLI::PositiveNumber);
  add_output_options(app, a.output);
  app.add_option(
      "--expect", a.expect,
      "Compare numbers and checksums of pairs with this file; recorded boxes that are not "
      "in it, with what the CPU finds");
  app.add_option("--cpu-answers", a.cpu_answers,
                 "Write such a file, by the CPU; nothing is measured");
  app.add_flag("--device", a.device, "Only print which GPU there is");
  app.add_option("--threads", a.threads, "Threads of the CPU; all by default");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return gpu::run(a);
}

}  // namespace throng::bench
