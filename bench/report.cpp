#include "bench/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/report/explanation.hpp"
#include "apps/report/format.hpp"
#include "bench/throng_methods.hpp"

namespace throng::bench {
namespace {

using report::format_count;
using report::format_ms;
using report::format_ratio;
using report::format_short;
using report::Table;

template <class F>
const Measurement* fastest(const Findings& f, const std::string& scene, std::size_t objects,
                           const F& wanted) {
  const Measurement* best = nullptr;
  for (const Measurement& r : f.measurements)
    if (r.measured && r.scene == scene && r.objects == objects && wanted(r) &&
        (!best || r.ms < best->ms))
      best = &r;
  return best;
}

std::vector<std::pair<std::string, std::size_t>> cases(const Findings& f) {
  std::vector<std::pair<std::string, std::size_t>> all;
  for (const Measurement& r : f.measurements)
    if (all.empty() || all.back() != std::make_pair(r.scene, r.objects))
      all.emplace_back(r.scene, r.objects);
  return all;
}

// "Embree" of "Embree rtcCollide", "baseline grid" of "baseline grid, ranges".
std::string library_of(const Measurement& r) {
  return r.method.substr(0, r.method.find_first_of(r.origin == Origin::other_library ? " ," : ","));
}

std::string ratio(const Measurement* other, const Measurement* mine) {
  return other && mine ? format_ratio(other->ms / mine->ms) : "";
}

// "cloth-ball" of "data/cloth-ball.npy"; a scene's name as it is.
std::string file_stem(const std::string& name) {
  const bool is_file = name.size() > 4 && name.compare(name.size() - 4, 4, ".npy") == 0;
  return is_file
             ? name.substr(name.find_last_of('/') + 1, name.size() - 4 - name.find_last_of('/') - 1)
             : name;
}

std::string hex(std::uint64_t x) { return fmt::format("{:016x}", x); }

}  // namespace

Table machine_table(const Findings& f) {
  Table t("Machine", {"", " "});
  for (const auto& [name, value] : f.machine) t.add_row({name, value});
  for (const Bandwidth& b : f.bandwidth)
    t.add_row({fmt::format("copy bandwidth, {} thread{}", b.threads, b.threads == 1 ? "" : "s"),
               fmt::format("{:.1f} GB/s, read and written", b.gb_per_s)});
  for (const auto& [name, value] : f.machine)
    if (name == "load when started" && std::strtod(value.c_str(), nullptr) > 0.5)
      t.add_note("The machine was not idle: the times are not reliable.");
  return t;
}

Table case_table(const Findings& f, const std::string& scene, std::size_t objects) {
  const Measurement* mine =
      fastest(f, scene, objects, [](const Measurement& r) { return r.method == throng_name; });
  Table t(fmt::format("{}, {} boxes{}", scene, format_count(objects),
                      mine ? fmt::format(": {} pairs, {:.2f} per box, checksum {}",
                                         format_count(mine->pairs),
                                         double(mine->pairs) / double(objects), hex(mine->checksum))
                           : ""),
          {"library", "threads", "ms", "least", "factor", "tests per box and pair", "peak memory",
           "remark"});
  for (const Measurement& r : f.measurements) {
    if (r.scene != scene || r.objects != objects) continue;
    if (!r.measured) {
      t.add_row({r.method, std::to_string(r.threads), "", "", "", "", "", "not run: " + r.note});
      continue;
    }
    // Relative to Throng on as many threads.
    const Measurement* equal = fastest(f, scene, objects, [&](const Measurement& x) {
      return x.method == throng_name && x.threads == r.threads;
    });
    std::string remark = r.plan;
    if (!r.agrees) remark = "DISAGREES: other pairs";
    t.add_row({r.method, std::to_string(r.threads), format_ms(r.ms), format_ms(r.least_ms),
               ratio(&r, equal), r.comparisons > 0 ? fmt::format("{:.1f}", r.comparisons) : "",
               r.peak_bytes ? report::format_bytes(double(r.peak_bytes)) : "", remark});
  }
  return t;
}

Table summary_table(const Findings& f, std::size_t most_rows) {
  Table t("Time to find all pairs of overlapping boxes that all move: median, ms per frame",
          {"scene", "boxes", "pairs", "Throng", "best other", "factor", "which library"});
  const std::vector<std::pair<std::string, std::size_t>> all = cases(f);
  bool any_other = false;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto& [scene, objects] = all[k];
    if (all.size() > most_rows && k + 1 < all.size() && all[k + 1].first == scene) continue;
    const Measurement* mine =
        fastest(f, scene, objects, [](const Measurement& r) { return r.method == throng_name; });
    if (!mine) continue;
    const Measurement* other = fastest(
        f, scene, objects, [](const Measurement& r) { return r.origin == Origin::other_library; });
    any_other = any_other || other;
    t.add_row({scene, format_short(objects), format_count(mine->pairs), format_ms(mine->ms),
               other ? format_ms(other->ms) : "", ratio(other, mine), other ? other->method : ""});
  }
  if (any_other)
    t.add_note(
        "Each library with its fastest setting and number of threads. factor: the time of the best "
        "other library divided by Throng's.");
  return t;
}

std::vector<Row> rows(const Findings& f) {
  std::vector<Row> all;
  for (const Bandwidth& b : f.bandwidth) {
    Row row;
    row.kind = "search";
    row.name = "copy";
    row.library = "memcpy";
    row.threads = b.threads;
    row.metric = "gb_per_s";
    row.value = b.gb_per_s;
    row.note = "bytes read and written";
    all.push_back(std::move(row));
  }
  for (const Measurement& m : f.measurements) {
    if (!m.measured) continue;
    Row row;
    row.kind = "search";
    row.name = file_stem(m.scene);
    row.objects = m.objects;
    row.library = m.method;
    row.threads = m.threads;
    row.metric = "search_ms";
    row.value = m.ms;
    row.least = m.least_ms;
    row.samples = m.samples;
    row.found = m.pairs;
    row.checksum = m.checksum;
    row.note = m.agrees ? m.plan : "other pairs than the first method";
    all.push_back(row);
    if (!m.peak_bytes) continue;
    row.metric = "peak_bytes";
    row.value = double(m.peak_bytes);
    row.least = 0;
    row.samples = 0;
    row.note.clear();
    all.push_back(std::move(row));
  }
  return all;
}

std::string json(const Findings& f) {
  nlohmann::ordered_json out;
  for (const auto& [name, value] : f.machine) out["machine"][name] = value;
  for (const Bandwidth& b : f.bandwidth)
    out["copy_gb_per_s"][std::to_string(b.threads)] = b.gb_per_s;
  out["rows"] = nlohmann::ordered_json::array();
  for (const Measurement& r : f.measurements) {
    nlohmann::ordered_json row = {{"scene", r.scene},       {"objects", r.objects},
                                  {"method", r.method},     {"threads", r.threads},
                                  {"measured", r.measured}, {"note", r.note}};
    if (r.measured) {
      row.update({{"ms", r.ms},
                  {"least_ms", r.least_ms},
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
      "medians of interleaved rounds. All methods' pairs were compared by count and checksum.");
  p.add(summary_table(f, f.measurements.size()));
  p.add(machine_table(f));
  std::map<std::string, std::string> notes;
  for (const Measurement& r : f.measurements)
    if (r.measured) notes.emplace(r.method, r.note);
  Table t("Libraries", {"library", "how it is run"});
  for (const auto& [name, note] : notes) t.add_row({name, note});
  p.add(t);
  std::vector<std::string> scenes;
  for (const Measurement& r : f.measurements)
    if (std::find(scenes.begin(), scenes.end(), r.scene) == scenes.end()) scenes.push_back(r.scene);
  for (const std::string& scene : scenes) {
    p.heading(scene);
    report::Plot time, times;
    time.title = scene + ": time per frame";
    times.title = scene + ": time relative to Throng's";
    time.y_label = "ms";
    times.y_label = "time / Throng's time";
    for (report::Plot* plot : {&time, &times}) {
      plot->x_label = "boxes";
      plot->log_x = plot->log_y = true;
    }
    // One line per library, in its fastest setting and thread count at each size.
    std::map<std::string, report::Series> lines, ratios;
    std::vector<std::string> order;
    for (const Measurement& r : f.measurements) {
      const bool shown = r.method == throng_name || r.origin != Origin::throng;
      if (r.scene != scene || !r.measured || !shown) continue;
      const std::string library = library_of(r);
      const Measurement* best = fastest(f, scene, r.objects, [&](const Measurement& x) {
        return x.origin == r.origin && library_of(x) == library &&
               (x.origin != Origin::throng || x.method == throng_name);
      });
      if (best != &r) continue;
      const Measurement* mine = fastest(
          f, scene, r.objects, [](const Measurement& x) { return x.method == throng_name; });
      if (std::find(order.begin(), order.end(), library) == order.end()) order.push_back(library);
      report::Series& line = lines[library];
      line.x.push_back(double(r.objects));
      line.y.push_back(r.ms);
      if (!mine) continue;
      report::Series& factor = ratios[library];
      factor.x.push_back(double(r.objects));
      factor.y.push_back(r.ms / mine->ms);
    }
    for (const std::string& name : order) {
      lines[name].name = ratios[name].name = name;
      lines[name].emphasis = ratios[name].emphasis = name == throng_name;
      // Throng is in both plots, so that each library has one colour.
      time.series.push_back(lines[name]);
      times.series.push_back(ratios[name]);
    }
    p.add(std::vector<report::Plot>{time, times});
    for (const auto& [s, objects] : cases(f))
      if (s == scene) p.add(case_table(f, s, objects));
    const auto explained = f.explanations.find(scene);
    if (explained == f.explanations.end()) continue;
    p.heading(fmt::format("{}: what determines Throng's time, {} boxes", scene,
                          format_count(explained->second.boxes)));
    report::explain(p, explained->second);
  }
  return p;
}

std::vector<std::string> disagreements(const Findings& f) {
  std::vector<std::string> lines;
  for (const Measurement& r : f.measurements)
    if (r.measured && !r.agrees)
      lines.push_back(fmt::format("{} ({} threads) found other pairs than Throng on {}, {} boxes",
                                  r.method, r.threads, r.scene, format_count(r.objects)));
  return lines;
}

}  // namespace throng::bench
