// Subcommand costs: what each number of base/cost_table.hpp is worth. Built only with
// THRONG_TUNE_COSTS, where the numbers can be changed while the program runs.
//
// Each number is halved and doubled, one at a time. All cases are timed with each value, one after
// the other, several rounds; the ratio of a case is that of the first quartiles (moving: of the
// medians) to those with the table's own numbers.
#include <throng/throng.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "base/cost_table.hpp"
#include "bench/cases.hpp"
#include "bench/random_motion.hpp"
#include "bench/require.hpp"
#include "bench/subcommands.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

using base::cost;
using base::CostTable;

struct Number {
  const char* name;
  double CostTable::*at;
};
#define THRONG_NUMBER(name) \
  { #name, &CostTable::name }
constexpr Number numbers[] = {
    THRONG_NUMBER(box_ns),
    THRONG_NUMBER(replica_ns),
    THRONG_NUMBER(record_ns),
    THRONG_NUMBER(column_ns),
    THRONG_NUMBER(empty_ns),
    THRONG_NUMBER(brute_force_ns),
    THRONG_NUMBER(brute_force_boxes),
    THRONG_NUMBER(extent_steps),
    THRONG_NUMBER(refine_boxes),
    THRONG_NUMBER(refine_sweep_ns),
    THRONG_NUMBER(refine_share),
    THRONG_NUMBER(refine_replicas),
    THRONG_NUMBER(tie_ns),
    THRONG_NUMBER(forbidden_share),
    THRONG_NUMBER(world_distance),
    THRONG_NUMBER(worlds_together_ns),
    THRONG_NUMBER(separation_ns),
    THRONG_NUMBER(full_object_ns),
    THRONG_NUMBER(full_pair_ns),
    THRONG_NUMBER(local_object_ns),
    THRONG_NUMBER(comparison_ns),
    THRONG_NUMBER(average_searches),
    THRONG_NUMBER(index_build_ns),
    THRONG_NUMBER(forest_build_ns),
    THRONG_NUMBER(forest_comparisons),
    THRONG_NUMBER(forest_pair_comparisons),
    THRONG_NUMBER(guard),
    THRONG_NUMBER(class_lines),
    THRONG_NUMBER(visit_ns),
    THRONG_NUMBER(index_query_ns),
    THRONG_NUMBER(parallel_ns),
};
#undef THRONG_NUMBER
static_assert(sizeof(CostTable) == std::size(numbers) * sizeof(double), "every number is listed");

// Other values of some numbers: "tie_ns=0,box_ns=2".
CostTable parse_table(const std::string& text) {
  CostTable table = cost;
  for (const std::string& part : CLI::detail::split(text, ',')) {
    const std::size_t equals = part.find('=');
    const std::string name = part.substr(0, equals);
    const auto* const found = std::find_if(std::begin(numbers), std::end(numbers),
                                           [&](const Number& n) { return name == n.name; });
    char* end = nullptr;
    const double value =
        equals == std::string::npos ? 0 : std::strtod(part.c_str() + equals + 1, &end);
    if (found == std::end(numbers) || !end || *end != '\0' || end == part.c_str() + equals + 1)
      throw common::Failure(
          fmt::format("--try: found '{}', wanted NAME=NUMBER with a name of cost_table.hpp", part));
    table.*found->at = value;
  }
  return table;
}

struct Variant {
  std::string name, setting;
  CostTable table;
};

// A case times each of `tables` some times: a list of times per table.
struct CostCase {
  std::string name;
  double quantile;
  std::function<std::vector<std::vector<double>>(const std::vector<CostTable>& tables, int rounds)>
      run;
};

CostCase search_case(const std::string& name, std::shared_ptr<const Case> c, Order order) {
  return {name, 0.25, [c, order](const std::vector<CostTable>& tables, int rounds) {
            Options options;
            options.backend = Backend::cpu;
            options.threads = 1;
            options.order = order;
            Finder finder(options);
            std::vector<std::vector<double>> times(tables.size());
            for (int round = -1; round < rounds; ++round) {
              for (std::size_t k = 0; k < tables.size(); ++k) {
                const std::size_t v = (k + static_cast<std::size_t>(round + 1)) % tables.size();
                cost = tables[v];
                for (std::size_t f = 0; f < 3; ++f) {
                  Boxes boxes(c->frames[c->index(f)].data(), c->objects);
                  if (!c->worlds.empty())
                    boxes.filters.world = {c->worlds.data(), c->objects, sizeof(std::int32_t)};
                  const double ms = time_ms([&] { require(finder.find(boxes)); });
                  // The first after a change of plan may allocate.
                  if (round >= 0 && f > 0) times[v].push_back(ms);
                }
              }
            }
            return times;
          }};
}

CostCase moving_case(const char* scene, std::size_t objects, double share, int frames) {
  return {fmt::format("{} {}, {}", scene, objects, share_text(share)), 0.5,
          [=](const std::vector<CostTable>& tables, int rounds) {
            RandomMotion motion(boxes_of(scene, objects), share);
            Options options;
            options.threads = 1;
            std::vector<std::unique_ptr<BroadPhase>> all;
            for (const CostTable& table : tables) {
              cost = table;
              all.push_back(std::make_unique<BroadPhase>(options));
              start_with(*all.back(), motion.boxes());
            }
            std::vector<std::vector<double>> times(tables.size());
            constexpr int warm_up = 12;
            for (int f = -warm_up; f < frames * rounds / 8; ++f) {
              const Moves moves = motion.next();
              for (std::size_t k = 0; k < tables.size(); ++k) {
                const std::size_t v = (k + static_cast<std::size_t>(f + warm_up)) % tables.size();
                cost = tables[v];
                const double ms = time_ms([&] { update(*all[v], moves); });
                if (f >= 0) times[v].push_back(ms);
              }
            }
            return times;
          }};
}

std::vector<CostCase> all_cases(const CaseOptions& a, const std::vector<std::string>& files) {
  std::vector<CostCase> cases;
  std::vector<std::pair<SceneChoice, std::size_t>> searches;
  for (const std::string& file : files) searches.push_back({find_scene(file), 0});
  for (const std::size_t n : {1000, 10000, 100000, 1000000}) {
    if (a.objects(n) != n) break;
    for (const SceneChoice& scene : all_scenes()) searches.push_back({scene, n});
  }
  for (const auto& [scene, n] : searches) {
    const auto c = std::make_shared<const Case>(make_case(scene, n, 2));
    const std::string name = fmt::format("{} {}", scene.label, c->objects);
    cases.push_back(search_case(name, c, Order::any));
    if (n <= 10000) cases.push_back(search_case(name + ", sorted", c, Order::canonical));
  }
  struct Moving {
    const char* scene;
    std::size_t objects;
    double share;
    int frames;
  };
  for (const Moving& m : {Moving{"uniform", 1000, 0.01, 300}, Moving{"uniform", 10000, 0.01, 80},
                          Moving{"uniform", 100000, 0.01, 40}, Moving{"uniform", 100000, 0.1, 16},
                          Moving{"uniform", 100000, 1, 10}, Moving{"pile", 100000, 0.01, 30},
                          Moving{"pile", 100000, 1, 6}, Moving{"mixed", 100000, 0.01, 24},
                          Moving{"clusters", 100000, 0.01, 30}, Moving{"rods", 100000, 0.01, 12}})
    if (a.objects(m.objects) == m.objects)
      cases.push_back(moving_case(m.scene, m.objects, m.share, m.frames));
  return cases;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(static_cast<double>(values.size() - 1) * q)];
}

void measure(const std::vector<Variant>& variants, const std::vector<CostCase>& cases, int rounds,
             Results& results) {
  const CostTable own = cost;
  std::vector<CostTable> tables = {own};
  for (const Variant& v : variants) tables.push_back(v.table);
  struct Ratio {
    double value;
    const CostCase* of;
  };
  std::vector<std::vector<Ratio>> ratios(variants.size());
  for (const CostCase& c : cases) {
    const std::vector<std::vector<double>> times = c.run(tables, rounds);
    const double before = quantile(times[0], c.quantile);
    for (std::size_t v = 0; v < variants.size(); ++v)
      ratios[v].push_back({quantile(times[v + 1], c.quantile) / before, &c});
  }
  cost = own;
  for (std::size_t v = 0; v < variants.size(); ++v) {
    double logs = 0;
    for (const Ratio& r : ratios[v]) logs += std::log(r.value);
    const auto [best, worst] =
        std::minmax_element(ratios[v].begin(), ratios[v].end(),
                            [](const Ratio& x, const Ratio& y) { return x.value < y.value; });
    Row row;
    row.kind = "costs";
    row.name = variants[v].name;
    row.setting = variants[v].setting;
    row.library = "Throng";
    row.metric = "time_ratio";
    row.value = std::exp(logs / static_cast<double>(ratios[v].size()));
    row.samples = ratios[v].size();
    row.note = fmt::format("{:.2f} to {:.2f} ({})", best->value, worst->value, worst->of->name);
    results.add(std::move(row));
  }
}

}  // namespace

int costs_command(int argc, char** argv) {
  CaseOptions a;
  std::vector<std::string> files, tries;
  CLI::App app{"What each tuned number is worth: the time with half and twice its value.",
               "throng-bench costs"};
  app.add_option("--files", files, "Also search these .npy files");
  app.add_option("--try", tries, "Instead: the time with these values, such as tie_ns=0,box_ns=2");
  int status = 0;
  if (!parse_case_options(app, a, "NUMBER", argc, argv, status)) return status;
  if (!a.max_objects) a.max_objects = 100000;
  Results results(a.output);
  std::vector<std::vector<Variant>> runs;
  for (const std::string& text : tries) runs.push_back({{text, "as given", parse_table(text)}});
  if (tries.empty()) {
    for (const Number& n : numbers) {
      if (!a.wanted(n.name)) continue;
      runs.emplace_back();
      for (const double factor : {0.5, 2.0}) {
        CostTable table = cost;
        table.*n.at *= factor;
        runs.back().push_back(
            {n.name, fmt::format("{:g} for {:g}", table.*n.at, cost.*n.at), table});
      }
    }
  }
  const std::vector<CostCase> cases = all_cases(a, files);
  for (const std::vector<Variant>& variants : runs) {
    measure(variants, cases, a.rounds_of(8), results);
    results.show(variants.front().name);
  }
  return common::exit_done;
}

}  // namespace throng::bench
