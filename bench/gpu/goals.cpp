// The goals of an H200, compared with the measurements.
#include <algorithm>
#include <cstdio>
#include <initializer_list>

#include "apps/report/format.hpp"
#include "bench/gpu/measurement.hpp"

namespace throng::bench::gpu {
namespace {

const Measurement* find(const std::vector<Measurement>& measurements, const std::string& what,
                        std::uint64_t objects, const std::string& setting = "unsorted") {
  for (const Measurement& r : measurements)
    if (r.what == what && r.objects == objects && r.setting == setting) return &r;
  return nullptr;
}

struct Goal {
  const char *scene, *setting;
  std::uint64_t objects;
  double must_ms, aim_ms;
};
// Boxes and pairs in device memory of an H200; all boxes move, unsorted pairs.
constexpr Goal all_goals[] = {
    {"uniform, density 2", "unsorted", 100000, 0.040, 0.020},
    {"uniform, density 2", "unsorted", 1000000, 0.20, 0.10},
    {"uniform, density 2", "unsorted", 10000000, 1.6, 0.9},
    {"uniform, density 2", "unsorted", 100000000, 18, 9},
    {"worlds", "unsorted", 8192 * 64, 0.030, 0.015},
    // No box has left its enlarged box.
    {"uniform, density 2", "nothing moves", 1000000, 0.020, 0.010},
    {"uniform, density 2", "nothing moves", 100000000, 2, 1},
    {"uniform, density 2", "all move in enlarged boxes", 1000000, 0.020, 0.010},
    {"uniform, density 2", "all move in enlarged boxes", 100000000, 2, 1},
};
constexpr double most_per_box_and_pair = 3;  // pile, mixed, clusters, relative to uniform
constexpr double most_for_order = 2;         // sorted, relative to unsorted
constexpr double most_bytes = 120;           // per box, in addition to boxes and pairs

std::string verdict(double value, double must, double aim) {
  return value <= aim ? "aim reached" : value <= must ? "reached" : "MISSED";
}
std::string text(double value) {
  char t[32];
  std::snprintf(t, sizeof t, "%.3g", value);
  return t;
}

}  // namespace

report::Table goals(const std::vector<Measurement>& measurements) {
  report::Table t("Goals", {"goal", "must", "aim", "measured", "verdict"});
  for (const Goal& g : all_goals) {
    const Measurement* r = find(measurements, g.scene, g.objects, g.setting);
    if (!r) continue;
    t.add_row(
        {std::string(g.scene) + ", " + report::format_count(g.objects) + ", " + g.setting + ", ms",
         text(g.must_ms), text(g.aim_ms), text(r->time.median_ms),
         verdict(r->time.median_ms, g.must_ms, g.aim_ms)});
  }
  for (const char* scene : {"pile", "mixed", "clusters"}) {
    for (const std::uint64_t n : {100000u, 1000000u, 10000000u}) {
      const Measurement *r = find(measurements, scene, n),
                        *base = find(measurements, "uniform, density 2", n);
      if (!r || !base) continue;
      const auto each = [](const Measurement& row) {
        return row.time.median_ms / static_cast<double>(row.objects + row.pairs);
      };
      const double ratio = each(*r) / each(*base);
      t.add_row({std::string(scene) + ", " + report::format_count(n) +
                     ", per box and pair, relative to uniform",
                 text(most_per_box_and_pair), "", text(ratio),
                 verdict(ratio, most_per_box_and_pair, 0)});
    }
  }
  for (const Measurement& r : measurements) {
    if (r.setting != "sorted" || r.experiment != "scaling") continue;
    const Measurement* any = find(measurements, r.what, r.objects);
    if (!any || any->time.median_ms <= 0) continue;
    const double ratio = r.time.median_ms / any->time.median_ms;
    t.add_row({"sorted, " + report::format_count(r.objects) + ", relative to unsorted",
               text(most_for_order), "", text(ratio), verdict(ratio, most_for_order, 0)});
  }
  for (const char* order : {"unsorted", "sorted"}) {
    const Measurement* worst = nullptr;
    for (const Measurement& r : measurements) {
      // The driver allocates pieces of 2 MiB: for fewer boxes they are most of it.
      if (r.setting != order || r.driver_bytes_per_box <= 0 || r.objects < 1000000) continue;
      if (!worst || r.driver_bytes_per_box > worst->driver_bytes_per_box) worst = &r;
    }
    if (!worst) continue;
    t.add_row({std::string("bytes per box in addition to boxes and pairs by the driver's count, ") +
                   order + ", the most (" + worst->what + ", " +
                   report::format_count(worst->objects) + ")",
               text(most_bytes), "", text(worst->driver_bytes_per_box),
               verdict(worst->driver_bytes_per_box, most_bytes, 0)});
  }
  const Measurement* brute = nullptr;
  for (const Measurement& r : measurements) {
    if (r.experiment != "crossover" || r.setting.find("all-pairs") == std::string::npos) continue;
    for (const Measurement& g : measurements) {
      const bool grid = g.experiment == "crossover" && g.objects == r.objects && &g != &r;
      if (grid && r.time.median_ms <= g.time.median_ms && (!brute || brute->objects < r.objects))
        brute = &r;
    }
  }
  if (brute)
    t.add_row({"all pairs is no slower than the grid up to", "", "",
               report::format_count(brute->objects) + " boxes", "see tile_search_limit"});
  t.add_note("Goals are those of an H200; times are medians of replays, each over another frame.");
  return t;
}

}  // namespace throng::bench::gpu
