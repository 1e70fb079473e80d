#include "work/worst_ratios.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "support/random.hpp"
#include "work/work_bounds.hpp"

namespace throng::tests {
namespace {

template <class... Values>
std::string format(const char* how, Values... values) {
  char line[400];
  std::snprintf(line, sizeof line, how, values...);
  return line;
}

std::string command(const WorkDraw& d) {
  return format("--family %s --objects %u --seed %llu", d.family.c_str(), d.objects,
                static_cast<unsigned long long>(d.seed));
}

}  // namespace

WorkDraw draw_work(std::uint64_t seed, std::uint32_t least, std::uint32_t most,
                   const std::string& family) {
  Random random(seed);
  const auto& names = work_families();
  WorkDraw draw{names[random.below(static_cast<std::uint32_t>(names.size()))], 0, seed};
  if (!family.empty()) draw.family = family;
  const double log = random.unit() * std::log(static_cast<double>(most) / least);
  draw.objects = static_cast<std::uint32_t>(least * std::exp(log));
  return draw;
}

bool WorstRatios::add(const WorkDraw& draw) {
  const WorkScene scene = make_work_scene(draw.family, draw.objects, draw.seed);
  WorkReport report = measure_work(scene);
  ++draws_;
  if (scene.boxes.size() < work_least) report.samples.clear();
  for (const WorkSample& sample : report.samples) {
    Worst& worst = worst_[{draw.family, sample.work}];
    if (worst.boxes != 0 && sample.ratio() <= worst.sample.ratio()) continue;
    worst = {sample, draw, scene.boxes.size()};
  }
  if (report.wrong.empty()) return true;
  wrong_ += report.wrong + ": " + command(draw) + "\n";
  return false;
}

std::string WorstRatios::text(bool only_violations) const {
  std::string lines;
  for (const auto& [key, worst] : worst_) {
    const WorkBound& bound = bound_of(key.first, key.second);
    const double ratio = worst.sample.ratio();
    if (only_violations && ratio <= bound.most) continue;
    lines += format("%-12s %-17s %10.2f of %-6g %s n %zu, cost %.0f, allowed %.0f: %s\n",
                    key.first.c_str(), to_string(key.second), ratio, bound.most,
                    ratio > bound.most ? "ABOVE" : "     ", worst.boxes, worst.sample.cost,
                    bound.most * worst.sample.budget, command(worst.draw).c_str());
  }
  return lines;
}

std::string WorstRatios::rows() const {
  std::string lines;
  for (const WorkBound& bound : work_bounds) {
    double ratio = 0;
    for (const auto& [key, worst] : worst_)
      if (&bound_of(key.first, key.second) == &bound) ratio = std::max(ratio, worst.sample.ratio());
    lines += format("    {\"%s\", Work::%s, %g, %.1f},\n", bound.family, to_string(bound.work),
                    bound.most, ratio);
  }
  return lines;
}

}  // namespace throng::tests
