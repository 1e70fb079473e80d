// throng-work-bound: draws scenes of all families for a given time, and prints the worst ratio of
// cost to budget of each family and call, with the draw that reproduces it.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "work/work_bounds.hpp"
#include "work/worst_ratios.hpp"

namespace throng::tests {
namespace {

using Clock = std::chrono::steady_clock;

struct Settings {
  double seconds = 3600, report_seconds = 60;
  std::uint64_t seed = 0;
  std::uint64_t draws = 0;  // 0: one if a seed is given, else as many as the time allows
  bool seeded = false, each_family = false;
  std::uint32_t objects = 0, least = work_least, most = 500000;
  std::string family;
};

int run(Settings settings) {
  if (!settings.seeded) settings.seed = std::random_device()();
  if (settings.draws == 0) settings.draws = settings.seeded ? 1 : ~std::uint64_t{0};
  std::printf("seed %llu\n", static_cast<unsigned long long>(settings.seed));
  std::vector<std::string> families{settings.family};  // "": drawn, too
  if (settings.each_family) families = work_families();
  WorstRatios worst_ratios;
  const auto start = Clock::now();
  auto last_report = start;
  const auto seconds = [](Clock::time_point since) {
    return std::chrono::duration<double>(Clock::now() - since).count();
  };
  for (std::uint64_t k = 0; k < settings.draws && seconds(start) < settings.seconds; ++k) {
    for (const std::string& family : families) {
      WorkDraw draw = draw_work(settings.seed + k, settings.least, settings.most, family);
      if (settings.objects != 0) draw.objects = settings.objects;
      worst_ratios.add(draw);
    }
    if (seconds(last_report) < settings.report_seconds) continue;
    last_report = Clock::now();
    std::printf("%.0f s, %llu draws\n%s%s", seconds(start),
                static_cast<unsigned long long>(worst_ratios.draws()), worst_ratios.wrong().c_str(),
                worst_ratios.violations().c_str());
    std::fflush(stdout);
  }
  std::printf("%llu draws\n%s\nRows of tests/work/work_bounds.hpp, as measured:\n%s\n%s",
              static_cast<unsigned long long>(worst_ratios.draws()), worst_ratios.table().c_str(),
              worst_ratios.rows().c_str(), worst_ratios.wrong().c_str());
  const std::string above = worst_ratios.violations();
  if (above.empty() && worst_ratios.wrong().empty()) {
    std::printf("all within their bounds\n");
    return 0;
  }
  std::printf("ABOVE THEIR BOUNDS OR WRONG:\n%s%s", above.c_str(), worst_ratios.wrong().c_str());
  return 1;
}

}  // namespace
}  // namespace throng::tests

int main(int argc, char** argv) {
  throng::tests::Settings settings;
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : nullptr;
    const auto number = [&] { return std::strtoull(value, nullptr, 10); };
    if (value && name == "--seconds") {
      settings.seconds = std::strtod(value, nullptr);
    } else if (value && name == "--report-seconds") {
      settings.report_seconds = std::strtod(value, nullptr);
    } else if (value && name == "--seed") {
      settings.seed = number();
      settings.seeded = true;
    } else if (value && name == "--draws") {
      settings.draws = number();
      settings.each_family = true;
    } else if (value && name == "--objects") {
      settings.objects = static_cast<std::uint32_t>(number());
    } else if (value && name == "--least") {
      settings.least = static_cast<std::uint32_t>(number());
    } else if (value && name == "--most") {
      settings.most = static_cast<std::uint32_t>(number());
    } else if (value && name == "--family") {
      settings.family = value;
    } else {
      std::printf(
          "throng-work-bound: '%s' is unknown or has no value; options: --seconds S (3600), "
          "--seed N (only that draw), --draws N (of each family), --objects N, --family NAME, "
          "--least N (1500) and --most N (500000) objects, --report-seconds S (60)\n",
          argv[i]);
      return 2;
    }
  }
  return throng::tests::run(settings);
}
