#include "bench/tell.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/library.hpp"
#include "report/explanation.hpp"
#include "report/format.hpp"

namespace throng::bench {
namespace {

using report::format_count;
using report::format_ms;
using report::format_ratio;
using report::format_short;
using report::Table;

struct Goal {
  const char* scene;
  std::size_t objects;
  double rival, plain;
};
// Ratios that Throng is to reach: to the fastest packaged rival, and to the better plain grid.
const Goal goals[] = {
    {"uniform", 1000, 10, 2},      {"uniform", 10000, 15, 4},        {"uniform", 100000, 18, 4.5},
    {"uniform", 1000000, 28, 4.5}, {"pile", 100000, 25, 3},          {"mixed", 100000, 20, 7.5},
    {"cloth-ball", 0, 10, 15},     {"armadillo-rollers", 0, 10, 10},
};
// What the better plain grid must reach against Embree, on two threads, to count as a yardstick.
const Goal yardsticks[] = {{"uniform", 100000, 4.3, 0},
                           {"uniform", 1000000, 6.6, 0},
                           {"pile", 100000, 9.5, 0},
                           {"mixed", 100000, 2.9, 0}};

const Goal* goal_of(const std::string& scene, std::size_t objects) {
  for (const Goal& g : goals) {
    if (g.objects == objects && scene == g.scene) return &g;
    if (g.objects == 0 && scene.find(g.scene) != std::string::npos) return &g;
  }
  return nullptr;
}

template <class F>
const Row* fastest(const Findings& f, const std::string& scene, std::size_t objects,
                   const F& wanted) {
  const Row* best = nullptr;
  for (const Row& r : f.rows)
    if (r.measured && r.scene == scene && r.objects == objects && wanted(r) &&
        (!best || r.ms < best->ms))
      best = &r;
  return best;
}

struct Standing {
  const Row *throng, *rival, *plain;  // null where not measured
};
// `threads` 0: each in its fastest thread count.
Standing standing(const Findings& f, const std::string& scene, std::size_t objects,
                  unsigned threads) {
  const auto fits = [&](const Row& r) { return threads == 0 || r.threads == threads; };
  return {
      fastest(f, scene, objects, [&](const Row& r) { return r.contender == main_row && fits(r); }),
      fastest(f, scene, objects,
              [&](const Row& r) {
                return r.kind == Kind::rival && (r.threads <= threads || threads == 0);
              }),
      fastest(f, scene, objects, [&](const Row& r) {
        return r.kind == Kind::plain && (r.threads <= threads || threads == 0);
      })};
}

double bandwidth(const Findings& f, unsigned threads) {
  double best = 0;
  for (const Bandwidth& b : f.bandwidth)
    if (b.threads <= threads) best = std::max(best, b.gb_per_s);
  return best;
}

std::vector<std::pair<std::string, std::size_t>> cases(const Findings& f) {
  std::vector<std::pair<std::string, std::size_t>> all;
  for (const Row& r : f.rows)
    if (all.empty() || all.back() != std::make_pair(r.scene, r.objects))
      all.emplace_back(r.scene, r.objects);
  return all;
}

std::string ratio(const Row* other, const Row* mine) {
  return other && mine ? format_ratio(other->ms / mine->ms) : "";
}

std::string hex(std::uint64_t x) { return fmt::format("{:016x}", x); }

}  // namespace

double information_floor_ms(std::size_t objects, std::uint64_t pairs, double gb_per_s) {
  return (24.0 * double(objects) + 8.0 * double(pairs)) / (gb_per_s * 1e6);
}
double sort_floor_ms(std::size_t objects, double gb_per_s) {
  return 164.0 * double(objects) / (gb_per_s * 1e6);
}

Table machine_table(const Findings& f) {
  Table t("Machine", {"", " "});
  for (const auto& [name, value] : f.machine) t.add_row({name, value});
  for (const Bandwidth& b : f.bandwidth)
    t.add_row({fmt::format("copy bandwidth, {} thread{}", b.threads, b.threads == 1 ? "" : "s"),
               fmt::format("{:.1f} GB/s, read and written", b.gb_per_s)});
  for (const auto& [name, value] : f.machine)
    if (name == "load when started" && std::strtod(value.c_str(), nullptr) > 0.5)
      t.add_note("The machine was not idle: times on several threads say little.");
  return t;
}

Table case_table(const Findings& f, const std::string& scene, std::size_t objects) {
  const Row* mine =
      fastest(f, scene, objects, [](const Row& r) { return r.contender == main_row; });
  Table t(fmt::format(
              "{}, {} boxes{}", scene, format_count(objects),
              mine ? fmt::format(": {} pairs, {:.2f} a box, checksum {}", format_count(mine->pairs),
                                 double(mine->pairs) / double(objects), hex(mine->checksum))
                   : ""),
          {"contender", "threads", "ms", "least", "to Throng", "cmp/(box+pair)", "peak", ""});
  for (const Row& r : f.rows) {
    if (r.scene != scene || r.objects != objects) continue;
    if (!r.measured) {
      t.add_row({r.contender, std::to_string(r.threads), "", "", "", "", "", "not run: " + r.note});
      continue;
    }
    // Each row beside Throng with as many threads.
    const Row* equal = fastest(f, scene, objects, [&](const Row& x) {
      return x.contender == main_row && x.threads == r.threads;
    });
    std::string remark = r.plan;
    if (!r.agrees) remark = "DISAGREES: found other pairs";
    t.add_row({r.contender, std::to_string(r.threads), format_ms(r.ms), format_ms(r.best_ms),
               ratio(&r, equal), r.comparisons > 0 ? fmt::format("{:.1f}", r.comparisons) : "",
               r.peak_bytes ? report::format_bytes(double(r.peak_bytes)) : "", remark});
  }
  return t;
}

Table summary_table(const Findings& f) {
  Table t(
      "Throng beside the fastest rival and the better plain grid (ms a frame, medians; each in its "
      "fastest thread count)",
      {"scene", "boxes", "pairs a box", "Throng", "threads", "fastest rival", "ms", "ratio", "goal",
       "plain grid", "ratio", "goal", "on 1 thread", "", "to floor"});
  for (const auto& [scene, objects] : cases(f)) {
    const Standing s = standing(f, scene, objects, 0), one = standing(f, scene, objects, 1);
    if (!s.throng) continue;
    const Goal* goal = goal_of(scene, objects);
    const auto target = [](double wanted, const Row* other, const Row* mine) {
      if (wanted == 0 || !other || !mine) return std::string();
      return format_ratio(wanted) + (other->ms / mine->ms >= wanted ? " met" : " missed");
    };
    const double floor = sort_floor_ms(objects, bandwidth(f, s.throng->threads));
    t.add_row({scene, format_short(objects),
               fmt::format("{:.2f}", double(s.throng->pairs) / double(objects)),
               format_ms(s.throng->ms), std::to_string(s.throng->threads),
               s.rival ? s.rival->contender : "none", s.rival ? format_ms(s.rival->ms) : "",
               ratio(s.rival, s.throng), target(goal ? goal->rival : 0, s.rival, s.throng),
               s.plain ? format_ms(s.plain->ms) : "", ratio(s.plain, s.throng),
               target(goal ? goal->plain : 0, s.plain, s.throng), ratio(one.rival, one.throng),
               ratio(one.plain, one.throng), format_ratio(s.throng->ms / floor)});
  }
  t.add_note("on 1 thread: the same two ratios, everybody on one thread");
  t.add_note(
      "to floor: beside one out-of-place counting sort and a scan, 164 bytes a box at the measured "
      "copy bandwidth");
  return t;
}

Table yardstick_table(const Findings& f) {
  Table t("Are the plain grids yardsticks? The better one beside Embree, on as many threads",
          {"scene", "boxes", "threads", "Embree ms", "plain ms", "ratio", "wanted", ""});
  for (const Goal& y : yardsticks) {
    unsigned most = 0;
    for (const Row& r : f.rows) most = std::max(most, r.threads);
    const auto on = [&](Kind kind, const char* name) {
      return fastest(f, y.scene, y.objects, [&](const Row& r) {
        return r.kind == kind && r.threads == most && r.contender.find(name) != std::string::npos;
      });
    };
    const Row *embree = on(Kind::rival, "Embree"), *plain = on(Kind::plain, "plain");
    if (!embree || !plain) continue;
    const double reached = embree->ms / plain->ms;
    t.add_row({y.scene, format_short(y.objects), std::to_string(most), format_ms(embree->ms),
               format_ms(plain->ms), format_ratio(reached), format_ratio(y.rival),
               reached >= 0.8 * y.rival ? "counts" : "does not count"});
  }
  t.add_note("wanted within 20 %; measured for two threads, where the figures come from");
  return t;
}

Table all_rows(const Findings& f) {
  Table t("All rows", {"scene", "objects", "contender", "kind", "threads", "measured", "ms",
                       "least_ms", "samples", "pairs", "checksum", "agrees", "comparisons",
                       "peak_bytes", "floor_ms", "information_floor_ms", "plan", "note"});
  for (const Row& r : f.rows) {
    const double gb = bandwidth(f, r.threads);
    const char* kind = r.kind == Kind::library ? "throng"
                       : r.kind == Kind::plain ? "plain"
                                               : "rival";
    if (!r.measured) {
      t.add_row({r.scene, std::to_string(r.objects), r.contender, kind, std::to_string(r.threads),
                 "0", "", "", "", "", "", "", "", "", "", "", "", r.note});
      continue;
    }
    t.add_row({r.scene, std::to_string(r.objects), r.contender, kind, std::to_string(r.threads),
               "1", fmt::format("{:.5f}", r.ms), fmt::format("{:.5f}", r.best_ms),
               std::to_string(r.samples), std::to_string(r.pairs), hex(r.checksum),
               r.agrees ? "1" : "0", r.comparisons > 0 ? fmt::format("{:.2f}", r.comparisons) : "",
               r.peak_bytes ? std::to_string(r.peak_bytes) : "",
               fmt::format("{:.5f}", sort_floor_ms(r.objects, gb)),
               fmt::format("{:.5f}", information_floor_ms(r.objects, r.pairs, gb)), r.plan,
               r.note});
  }
  return t;
}

std::string json(const Findings& f) {
  nlohmann::ordered_json out;
  for (const auto& [name, value] : f.machine) out["machine"][name] = value;
  for (const Bandwidth& b : f.bandwidth)
    out["copy_gb_per_s"][std::to_string(b.threads)] = b.gb_per_s;
  out["rows"] = nlohmann::ordered_json::array();
  for (const Row& r : f.rows) {
    nlohmann::ordered_json row = {{"scene", r.scene},         {"objects", r.objects},
                                  {"contender", r.contender}, {"threads", r.threads},
                                  {"measured", r.measured},   {"note", r.note}};
    if (r.measured) {
      row.update({{"ms", r.ms},
                  {"least_ms", r.best_ms},
                  {"samples", r.samples},
                  {"pairs", r.pairs},
                  {"checksum", hex(r.checksum)},
                  {"agrees", r.agrees},
                  {"comparisons", r.comparisons},
                  {"peak_bytes", r.peak_bytes},
                  {"plan", r.plan}});
    }
    out["rows"].push_back(row);
  }
  return out.dump(2) + "\n";
}

report::Page page(const Findings& f) {
  report::Page p("Throng: how long it takes to find every pair");
  p.paragraph(
      "A time is from the caller's boxes to the pairs in memory, every box moving in every frame; "
      "medians of interleaved rounds. All contenders' pairs were compared by count and checksum.");
  p.add(machine_table(f));
  p.add(summary_table(f));
  p.add(yardstick_table(f));
  std::map<std::string, std::string> notes;
  for (const Row& r : f.rows)
    if (r.measured) notes.emplace(r.contender, r.note);
  Table t("Contenders", {"contender", "how it is run"});
  for (const auto& [name, note] : notes) t.add_row({name, note});
  p.add(t);
  std::vector<std::string> scenes;
  for (const Row& r : f.rows)
    if (std::find(scenes.begin(), scenes.end(), r.scene) == scenes.end()) scenes.push_back(r.scene);
  for (const std::string& scene : scenes) {
    p.heading(scene);
    report::Plot time, times;
    time.title = scene + ": time a frame";
    times.title = scene + ": how many times Throng's time";
    time.y_label = "ms";
    times.y_label = "ratio, on as many threads or the contender's one";
    for (report::Plot* plot : {&time, &times}) {
      plot->x_label = "boxes";
      plot->log_x = plot->log_y = true;
    }
    std::map<std::string, report::Series> lines, ratios;
    std::vector<std::string> order;
    report::Series floor{"floor (164 bytes a box)", {}, {}, false, true};
    for (const Row& r : f.rows) {
      const bool shown = r.contender == main_row || r.kind != Kind::library;
      if (r.scene != scene || !r.measured || !shown) continue;
      if (lines.find(r.contender) == lines.end()) order.push_back(r.contender);
      // The fastest thread count of each.
      const Row* best =
          fastest(f, scene, r.objects, [&](const Row& x) { return x.contender == r.contender; });
      if (best != &r) continue;
      const Row* mine =
          fastest(f, scene, r.objects, [](const Row& x) { return x.contender == main_row; });
      report::Series& line = lines[r.contender];
      line.x.push_back(double(r.objects));
      line.y.push_back(r.ms);
      report::Series& factor = ratios[r.contender];
      factor.x.push_back(double(r.objects));
      factor.y.push_back(r.ms / mine->ms);
      if (&r == mine) {
        floor.x.push_back(double(r.objects));
        floor.y.push_back(sort_floor_ms(r.objects, bandwidth(f, r.threads)));
      }
    }
    for (const std::string& name : order) {
      for (auto* of : {&lines, &ratios})
        (*of)[name].name = name.size() > 32 ? name.substr(0, 31) + "…" : name;
      lines[name].emphasis = ratios[name].emphasis = name == main_row;
      time.series.push_back(lines[name]);
      if (name != main_row) times.series.push_back(ratios[name]);
    }
    time.series.push_back(floor);
    p.add(time);
    p.add(times);
    for (const auto& [s, objects] : cases(f))
      if (s == scene) p.add(case_table(f, s, objects));
    const auto explained = f.explanations.find(scene);
    if (explained == f.explanations.end()) continue;
    p.heading(fmt::format("{}: why Throng takes what it takes, {} boxes", scene,
                          format_count(explained->second.boxes)));
    report::explain(p, explained->second);
  }
  return p;
}

std::vector<std::string> disagreements(const Findings& f) {
  std::vector<std::string> lines;
  for (const Row& r : f.rows)
    if (r.measured && !r.agrees)
      lines.push_back(fmt::format("{} ({} threads) found other pairs than the rest on {}, {} boxes",
                                  r.contender, r.threads, r.scene, format_count(r.objects)));
  return lines;
}

}  // namespace throng::bench
