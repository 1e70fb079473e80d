// Table 2, and the cost of a mapping alone.
#include <map>
#include <utility>

#include <fmt/format.h>

#include "apps/paper/cuda.hpp"
#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/evaluation/instructions.hpp"
#include "apps/paper/failure.hpp"
#include "apps/report/format.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

Variant make_variant(MappingKind mapping, RootKind root = RootKind::float32, int steps = 2) {
  Variant variant;
  variant.mapping = mapping;
  variant.root = root;
  variant.steps = steps;
  variant.output = Output::pairs;
  return variant;
}

struct MappingChoice {
  const char* name;
  Variant variant;
};
std::vector<MappingChoice> mapping_choices() {
  return {{"mapping, float32 root", make_variant(MappingKind::formula)},
          {"lazy", make_variant(MappingKind::lazy)},
          {"mapping, float64 root", make_variant(MappingKind::formula, RootKind::float64)},
          {"mapping, Carmack, 2 steps", make_variant(MappingKind::formula, RootKind::carmack)},
          {"mapping, Lomont, 2 steps", make_variant(MappingKind::formula, RootKind::lomont)},
          {"mapping, exact root", make_variant(MappingKind::exact)},
          {"tile fold", make_variant(MappingKind::fold)},
          {"stored list", make_variant(MappingKind::stored)}};
}

// The paper's Table 2, ms.
struct PaperRow {
  std::uint64_t n;
  double mapping, lazy;
};
constexpr PaperRow paper_rows[] = {{1000, 0.21, 0.25}, {10000, 2.25, 4.28}, {100000, 29.66, 58.24}};

// For this many consecutive threads, each adding its pair to a sum.
std::optional<std::uint64_t> instructions_of(const Variant& variant, std::uint64_t n,
                                             std::uint64_t begin, std::uint64_t count) {
  std::vector<Pair> list;
  if (variant.mapping == MappingKind::stored) {
    list.resize(base::pair_count(n));
    for (std::uint64_t k = begin; k < begin + count; ++k) Exact{}(k, n, list[k]);
  }
  return with_mapping(variant, list.data(), [&](const auto& mapping) {
    [[maybe_unused]] volatile std::uint64_t kept = 0;
    return count_instructions([&] {
      std::uint64_t sum = 0;
      for (std::uint64_t t = begin; t < begin + count; ++t) {
        Pair pair{};
        if (mapping(t, n, pair)) sum += pair.first + 3 * std::uint64_t{pair.second};
      }
      kept = sum;
    });
  });
}

double pairs_per_second(std::uint64_t n, double ms) {
  return static_cast<double>(base::pair_count(n)) / (ms * 1e6);  // in 10^9
}

}  // namespace

Section table2(const Lab& lab) {
  Section section("table2", "Table 2: from thread to pair, all n(n-1)/2 pairs tested");
  // All pairs of 100K objects take minutes on a CPU: above this size only the paper's two mappings.
  const std::uint64_t cpu_limit = 10000;
  for (const DeviceKind device : lab.devices()) {
    std::map<std::string, report::Series> series;
    std::string verdict;
    for (const std::uint64_t n : lab.sizes({1000, 10000, 100000}, 10000)) {
      const Boxes boxes = make_scene("uniform", n, 1, 1);
      double ms[2] = {0, 0};
      for (const MappingChoice& w : mapping_choices()) {
        const bool mapping = std::string(w.name) == "mapping, float32 root";
        const bool lazy = w.variant.mapping == MappingKind::lazy;
        if (device == DeviceKind::cpu && n > cpu_limit && !mapping && !lazy) continue;
        lab.say(fmt::format("Table 2: {}, {} objects, {}", w.name, report::format_short(n),
                            lab.name(device)));
        const Lab::Measurement measurement = lab.run(w.variant, boxes.frame(0), n, device);
        Row row = lab.row(w.name, n, "search", device, measurement, &Times::search);
        for (const PaperRow& g : paper_rows) {
          if (g.n == n && mapping) row.paper = g.mapping;
          if (g.n == n && lazy) row.paper = g.lazy;
        }
        if (row.measured) {
          if (mapping) ms[0] = *row.measured;
          if (lazy) ms[1] = *row.measured;
          report::Series& line = series[w.name];
          line.name = w.name;
          line.emphasis = mapping;
          line.x.push_back(static_cast<double>(n));
          line.y.push_back(*row.measured);
          row.found = fmt::format("{:.3g} G pairs/s", pairs_per_second(n, *row.measured));
          if (row.paper) {
            row.found += fmt::format("; the paper's time would be {:.3g} G pairs/s",
                                     pairs_per_second(n, *row.paper));
          }
        }
        section.rows.push_back(std::move(row));
      }
      if (ms[0] <= 0 || ms[1] <= 0) continue;
      for (const PaperRow& g : paper_rows) {
        if (g.n != n) continue;
        Row row = lab.row("lazy / mapping", n, "times", "", device);
        row.paper = g.lazy / g.mapping;
        row.paper_text = report::format_ms(*row.paper);
        row.measured = ms[1] / ms[0];
        row.found = (*row.measured > 1) == (*row.paper > 1) ? "agrees: the mapping is faster"
                                                            : "differs: the lazy mapping is faster";
        verdict += fmt::format("{}{} at {}", verdict.empty() ? "" : ", ",
                               report::format_ratio(*row.measured), report::format_short(n));
        section.rows.push_back(std::move(row));
      }
    }
    if (!verdict.empty()) {
      section.finding += fmt::format("On {} the lazy mapping takes {} the time of the mapping.  ",
                                     lab.name(device), verdict);
    }
    report::Plot plot{"Table 2, " + lab.name(device), "objects", "ms", true, true, {}};
    for (const MappingChoice& w : mapping_choices()) {
      if (series.count(w.name) != 0) plot.series.push_back(series[w.name]);
    }
    report::Series paper[2] = {{"paper: mapping", {}, {}, false, true},
                               {"paper: lazy", {}, {}, false, true}};
    for (const PaperRow& g : paper_rows) {
      paper[0].x.push_back(static_cast<double>(g.n));
      paper[0].y.push_back(g.mapping);
      paper[1].x.push_back(static_cast<double>(g.n));
      paper[1].y.push_back(g.lazy);
    }
    plot.series.push_back(paper[0]);
    plot.series.push_back(paper[1]);
    section.plots.push_back(std::move(plot));
  }

  // 3.2.2: on a sequential processor the lazy mapping is four times faster, 4.51 s for 10K objects.
  const std::uint64_t n = lab.quick() ? 5000 : 10000;
  if (n <= lab.setting().up_to) {
    lab.say("Table 2: one thread of the processor");
    const Boxes boxes = make_scene("uniform", n, 1, 1);
    const Lab::Measurement mapping =
        lab.run(mapping_choices()[0].variant, boxes.frame(0), n, DeviceKind::cpu, 1);
    const Lab::Measurement lazy =
        lab.run(mapping_choices()[1].variant, boxes.frame(0), n, DeviceKind::cpu, 1);
    Row row = lab.row("lazy", n, "search", DeviceKind::cpu, lazy, &Times::search);
    row.device += ", only 1 used";
    if (n == 10000) row.paper = 4510;
    row.found = speed_sentence(row);
    Row ratio = lab.row("mapping / lazy", n, "times", "", DeviceKind::cpu);
    ratio.device = row.device;
    ratio.paper = 4;
    ratio.measured = mapping.measured->step.times.search / lazy.measured->step.times.search;
    ratio.found = *ratio.measured > 1
                      ? fmt::format(
                            "agrees in kind: on one thread the lazy mapping is faster,  "
                            "by {}",
                            report::format_ratio(*ratio.measured))
                      : "differs: the mapping is faster on one thread, too";
    section.rows.push_back(std::move(row));
    section.rows.push_back(std::move(ratio));
  }
  section.words = {
      "Each pair is tested once, through a counter into a list. The paper's times grow in step "
      "with "
      "n where the pairs grow with its square, so they cannot be times of all pairs; see the "
      "errata."};
  return section;
}

Section mapping_cost(const Lab& lab) {
  Section section("cost", "The cost of a mapping alone");
  const std::uint64_t n = std::min<std::uint64_t>(lab.quick() ? 2000 : 5000, lab.setting().up_to);
  const double pairs = static_cast<double>(base::pair_count(n));
  // Starts in the middle of the triangle, where rare row ends are as frequent as over all n.
  const std::uint64_t begin = base::pair_count(n) / 2, few = lab.quick() ? 200 : 1000;
  for (const DeviceKind device : lab.devices()) {
    std::string fastest;
    double least = 0;
    for (const MappingChoice& w : mapping_choices()) {
      lab.say(fmt::format("mapping cost: {}, {}", w.name, lab.name(device)));
      const MappingTime time = device == DeviceKind::cuda
                                   ? time_mapping_on_cuda(w.variant, n, lab.repeat())
                                   : time_mapping_on_host(w.variant, n, lab.repeat(), 1);
      Row row = lab.row(w.name, n, "time", "ns per pair", device);
      if (device == DeviceKind::cpu) row.device += ", only 1 used";
      row.measured = time.ms * 1e6 / pairs;
      row.checksum = time.sum;
      if (fastest.empty() || *row.measured < least) {
        least = *row.measured;
        fastest = w.name;
      }
      section.rows.push_back(row);
      if (device != DeviceKind::cpu) continue;
      row.quantity = "instructions";
      row.unit = "a pair";
      row.measured.reset();
      row.checksum.reset();
      const double share = static_cast<double>(thread_count(w.variant, n)) /
                           static_cast<double>(base::pair_count(n));
      if (const auto count = instructions_of(w.variant, n, begin, few)) {
        row.measured = static_cast<double>(*count) / static_cast<double>(few) * share;
      } else {
        row.found = "not counted: this system does not allow tracing";
      }
      section.rows.push_back(row);
    }
    section.finding += fmt::format("On {} the cheapest mapping is the {}, {} ns per pair.  ",
                                   lab.name(device), fastest, report::format_ms(least));
  }
  section.words = {
      "No boxes are read and nothing is written but a sum of all numbers of pairs. Instructions "
      "are "
      "counted one by one, over some threads in a row. The lazy mapping has about two threads per "
      "pair;  "
      "the tile fold does here by a division what a launch in two dimensions would have for "
      "nothing."};
  return section;
}

}  // namespace throng::paper
