// The goals, and what was measured of them.
#include <algorithm>
#include <cstdio>
#include <initializer_list>

#include "bench/gpu/row.hpp"
#include "report/format.hpp"

namespace throng::bench::gpu {
namespace {

const Row* find(const std::vector<Row>& rows, const std::string& what, std::uint64_t objects,
                const std::string& order = "any") {
  for (const Row& r : rows)
    if (r.what == what && r.objects == objects && r.order == order && r.experiment != "stages")
      return &r;
  return nullptr;
}

struct Goal {
  const char* scene;
  std::uint64_t objects;
  double must_ms, aim_ms;
};
// Boxes and pairs on an H200, from scratch each frame, in any order.
constexpr Goal goals[] = {
    {"uniform, density 2", 100000, 0.040, 0.020},
    {"uniform, density 2", 1000000, 0.20, 0.10},
    {"uniform, density 2", 10000000, 1.6, 0.9},
    {"uniform, density 2", 100000000, 18, 9},
    {"worlds", 8192 * 64, 0.030, 0.015},
    // Nothing has left its fat box: the goal is of both.
    {"live, nothing moves", 1000000, 0.020, 0.010},
    {"live, nothing moves", 100000000, 2, 1},
    {"live, all move in fat boxes", 1000000, 0.020, 0.010},
    {"live, all move in fat boxes", 100000000, 2, 1},
};
constexpr double most_per_box_and_pair = 3;  // pile, mixed, clusters against uniform
constexpr double most_for_order = 2;         // canonical against any
constexpr double most_bytes = 120;           // a box, beside boxes and pairs

std::string verdict(double value, double must, double aim) {
  return value <= aim ? "aim reached" : value <= must ? "reached" : "MISSED";
}
std::string text(double value) {
  char t[32];
  std::snprintf(t, sizeof t, "%.3g", value);
  return t;
}

}  // namespace

report::Table summary(const std::vector<Row>& rows) {
  report::Table t("Goals", {"goal", "must", "aim", "measured", "verdict"});
  for (const Goal& g : goals) {
    const Row* r = find(rows, g.scene, g.objects);
    if (!r) continue;
    t.add_row({std::string(g.scene) + ", " + report::format_count(g.objects) + ", ms",
               text(g.must_ms), text(g.aim_ms), text(r->time.median_ms),
               verdict(r->time.median_ms, g.must_ms, g.aim_ms)});
  }
  for (const char* scene : {"pile", "mixed", "clusters"}) {
    for (const std::uint64_t n : {100000u, 1000000u, 10000000u}) {
      const Row *r = find(rows, scene, n), *base = find(rows, "uniform, density 2", n);
      if (!r || !base) continue;
      const auto each = [](const Row& row) {
        return row.time.median_ms / static_cast<double>(row.objects + row.pairs);
      };
      const double ratio = each(*r) / each(*base);
      t.add_row(
          {std::string(scene) + ", " + report::format_count(n) + ", a box or pair against uniform",
           text(most_per_box_and_pair), "", text(ratio), verdict(ratio, most_per_box_and_pair, 0)});
    }
  }
  for (const Row& r : rows) {
    if (r.order != "canonical" || r.experiment != "scaling") continue;
    const Row* any = find(rows, r.what, r.objects);
    if (!any || any->time.median_ms <= 0) continue;
    const double ratio = r.time.median_ms / any->time.median_ms;
    t.add_row({"canonical order, " + report::format_count(r.objects) + ", against any",
               text(most_for_order), "", text(ratio), verdict(ratio, most_for_order, 0)});
  }
  for (const char* order : {"any", "canonical"}) {
    const Row* worst = nullptr;
    for (const Row& r : rows) {
      // The driver gives pieces of 2 MiB: below this they are most of it.
      if (r.order != order || r.driver_bytes_per_box <= 0 || r.objects < 1000000) continue;
      if (!worst || r.driver_bytes_per_box > worst->driver_bytes_per_box) worst = &r;
    }
    if (!worst) continue;
    t.add_row({std::string("bytes a box beside boxes and pairs by the driver's count, ") + order +
                   " order, the most (" + worst->what + ", " +
                   report::format_count(worst->objects) + ")",
               text(most_bytes), "", text(worst->driver_bytes_per_box),
               verdict(worst->driver_bytes_per_box, most_bytes, 0)});
  }
  const Row* brute = nullptr;
  for (const Row& r : rows) {
    if (r.experiment != "crossover" || r.what.find("all-pairs") == std::string::npos) continue;
    for (const Row& g : rows) {
      const bool grid = g.experiment == "crossover" && g.objects == r.objects && &g != &r;
      if (grid && r.time.median_ms <= g.time.median_ms && (!brute || brute->objects < r.objects))
        brute = &r;
    }
  }
  if (brute)
    t.add_row({"brute force is no slower than the grid up to", "", "",
               report::format_count(brute->objects) + " boxes", "see tile_search_limit"});
  t.add_note("Goals are those of an H200; times are medians of replays, each over another frame.");
  return t;
}

}  // namespace throng::bench::gpu
