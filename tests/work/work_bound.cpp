// throng-work-bound: draws scenes of all families for a given time, and prints the worst ratio of
// cost to share of each family and call, with the draw that reproduces it.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "work/bounds.hpp"
#include "work/tally.hpp"

namespace throng::tests {
namespace {

using Clock = std::chrono::steady_clock;

struct Wanted {
  double seconds = 3600, tell_seconds = 60;
  std::uint64_t seed = 0;
  std::uint64_t draws = 0;  // 0: one if a seed is given, else as many as the time allows
  bool seeded = false, each_family = false;
  std::uint32_t objects = 0, least = work_least, most = 500000;
  std::string family;
};

int run(Wanted wanted) {
  if (!wanted.seeded) wanted.seed = std::random_device()();
  if (wanted.draws == 0) wanted.draws = wanted.seeded ? 1 : ~std::uint64_t{0};
  std::printf("seed %llu\n", static_cast<unsigned long long>(wanted.seed));
  std::vector<std::string> families{wanted.family};  // "": drawn, too
  if (wanted.each_family) families = work_families();
  WorkTally tally;
  const auto start = Clock::now();
  auto told = start;
  const auto seconds = [](Clock::time_point since) {
    return std::chrono::duration<double>(Clock::now() - since).count();
  };
  for (std::uint64_t k = 0; k < wanted.draws && seconds(start) < wanted.seconds; ++k) {
    for (const std::string& family : families) {
      WorkDraw draw = draw_work(wanted.seed + k, wanted.least, wanted.most, family);
      if (wanted.objects != 0) draw.objects = wanted.objects;
      tally.add(draw);
    }
    if (seconds(told) < wanted.tell_seconds) continue;
    told = Clock::now();
    std::printf("%.0f s, %llu draws\n%s%s", seconds(start),
                static_cast<unsigned long long>(tally.draws()), tally.wrong().c_str(),
                tally.violations().c_str());
    std::fflush(stdout);
  }
  std::printf("%llu draws\n%s\nRows of tests/work/bounds.hpp, as measured:\n%s\n%s",
              static_cast<unsigned long long>(tally.draws()), tally.table().c_str(),
              tally.rows().c_str(), tally.wrong().c_str());
  const std::string above = tally.violations();
  if (above.empty() && tally.wrong().empty()) {
    std::printf("all within their bounds\n");
    return 0;
  }
  std::printf("ABOVE THEIR BOUNDS OR WRONG:\n%s%s", above.c_str(), tally.wrong().c_str());
  return 1;
}

}  // namespace
}  // namespace throng::tests

int main(int argc, char** argv) {
  throng::tests::Wanted wanted;
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : nullptr;
    const auto number = [&] { return std::strtoull(value, nullptr, 10); };
    if (value && name == "--seconds") {
      wanted.seconds = std::strtod(value, nullptr);
    } else if (value && name == "--report-seconds") {
      wanted.tell_seconds = std::strtod(value, nullptr);
    } else if (value && name == "--seed") {
      wanted.seed = number();
      wanted.seeded = true;
    } else if (value && name == "--draws") {
      wanted.draws = number();
      wanted.each_family = true;
    } else if (value && name == "--objects") {
      wanted.objects = static_cast<std::uint32_t>(number());
    } else if (value && name == "--least") {
      wanted.least = static_cast<std::uint32_t>(number());
    } else if (value && name == "--most") {
      wanted.most = static_cast<std::uint32_t>(number());
    } else if (value && name == "--family") {
      wanted.family = value;
    } else {
      std::printf(
          "throng-work-bound: '%s' is unknown or has no value; options: --seconds S (3600), "
          "--seed N (only that draw), --draws N (of each family), --objects N, --family NAME, "
          "--least N (1500) and --most N (500000) objects, --report-seconds S (60)\n",
          argv[i]);
      return 2;
    }
  }
  return throng::tests::run(wanted);
}
