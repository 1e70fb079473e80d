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
#include <cstring>
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

// The members of CostTable, in order.
constexpr const char* names[] = {"box_ns",
                                 "replica_ns",
                                 "record_ns",
                                 "column_ns",
                                 "empty_ns",
                                 "brute_force_ns",
                                 "brute_force_boxes",
                                 "extent_steps",
                                 "refine_boxes",
                                 "refine_sweep_ns",
                                 "refine_share",
                                 "refine_replicas",
                                 "tie_ns",
                                 "forbidden_share",
                                 "world_distance",
                                 "worlds_together_ns",
                                 "separation_ns",
                                 "sweep_wide.start_ns",
                                 "sweep_wide.box_ns",
                                 "sweep_wide.long_start_ns",
                                 "sweep_wide.long_box_ns",
                                 "sweep_narrow.start_ns",
                                 "sweep_narrow.box_ns",
                                 "sweep_narrow.long_start_ns",
                                 "sweep_narrow.long_box_ns",
                                 "sweep_scalar.start_ns",
                                 "sweep_scalar.box_ns",
                                 "sweep_scalar.long_start_ns",
                                 "sweep_scalar.long_box_ns",
                                 "broadcast_window",
                                 "shared_steps",
                                 "set_ratio",
                                 "set_window",
                                 "threads_boxes",
                                 "team_boxes",
                                 "wide_columns",
                                 "stream_bytes",
                                 "full_object_ns",
                                 "full_pair_ns",
                                 "local_object_ns",
                                 "comparison_ns",
                                 "average_searches",
                                 "index_build_ns",
                                 "forest_build_ns",
                                 "forest_comparisons",
                                 "forest_pair_comparisons",
                                 "guard",
                                 "class_lines",
                                 "visit_ns",
                                 "index_query_ns",
                                 "parallel_ns"};
constexpr std::size_t number_count = std::size(names);
static_assert(sizeof(CostTable) == number_count * sizeof(double), "every number has a name");

double get(const CostTable& table, std::size_t k) {
  double value;
  std::memcpy(&value, reinterpret_cast<const char*>(&table) + k * sizeof value, sizeof value);
  return value;
}
void set(CostTable& table, std::size_t k, double value) {
  std::memcpy(reinterpret_cast<char*>(&table) + k * sizeof value, &value, sizeof value);
}

// Other values of some numbers: "tie_ns=0,box_ns=2".
CostTable parse_table(const std::string& text) {
  CostTable table = cost;
  for (const std::string& part : CLI::detail::split(text, ',')) {
    const std::size_t equals = part.find('=');
    const std::string name = part.substr(0, equals);
    const auto* const found = std::find(std::begin(names), std::end(names), name);
    char* end = nullptr;
    const double value =
        equals == std::string::npos ? 0 : std::strtod(part.c_str() + equals + 1, &end);
    if (found == std::end(names) || !end || *end != '\0' || end == part.c_str() + equals + 1 ||
        !(value >= 0 && value <= 1e9))
      throw common::Failure(
          fmt::format("--try: found '{}', wanted NAME=NUMBER with a name of cost_table.hpp and a "
                      "number of 0 to 1e9",
                      part));
    set(table, static_cast<std::size_t>(found - names), value);
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

// Times search(finder, call) with each table, three calls in a row; the first after a change of
// plan may allocate and does not count.
template <class Search>
std::vector<std::vector<double>> time_searches(const std::vector<CostTable>& tables, int rounds,
                                               Order order, const Search& search) {
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
      for (std::size_t call = 0; call < 3; ++call) {
        const double ms = time_ms([&] { require(search(finder, call)); });
        if (round >= 0 && call > 0) times[v].push_back(ms);
      }
    }
  }
  return times;
}

CostCase search_case(const std::string& name, std::shared_ptr<const Case> c, Order order) {
  return {name, 0.25, [c, order](const std::vector<CostTable>& tables, int rounds) {
            return time_searches(tables, rounds, order, [&](Finder& finder, std::size_t f) {
              Boxes boxes(c->frames[c->index(f)].data(), c->objects);
              if (!c->worlds.empty())
                boxes.filters.world = {c->worlds.data(), c->objects, sizeof(std::int32_t)};
              return finder.find(boxes);
            });
          }};
}

// The boxes as two sets: one of `every` is in the second.
CostCase two_sets_case(const std::string& name, const Case& c, std::size_t every) {
  auto sets = std::make_shared<std::vector<Box>[]>(2);
  for (std::size_t i = 0; i < c.objects; ++i)
    sets[i % every == 0 ? 1 : 0].push_back(c.frames[0][i]);
  return {fmt::format("{}, one in {}", name, every), 0.25,
          [sets](const std::vector<CostTable>& tables, int rounds) {
            return time_searches(tables, rounds, Order::any, [&](Finder& finder, std::size_t) {
              return finder.find(sets[0], sets[1]);
            });
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
            for (int f = -warm_up; f < std::max(1, frames * rounds / 8); ++f) {
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
    if (n == 10000 && c->worlds.empty())
      for (const std::size_t every : {2, 100}) cases.push_back(two_sets_case(name, *c, every));
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
    row.setting =
        fmt::format("{} ({:.2f} to {:.2f})", variants[v].setting, best->value, worst->value);
    row.library = "Throng";
    row.metric = "time_ratio";
    row.value = std::exp(logs / static_cast<double>(ratios[v].size()));
    row.samples = ratios[v].size();
    row.note = fmt::format("greatest: {}", worst->of->name);
    results.add(std::move(row));
  }
}

}  // namespace

int costs_command(int argc, char** argv) {
  CaseOptions a;
  std::vector<std::string> files, tries;
  CLI::App app{
      "What each tuned number is worth: the time with half and twice its value. Searches take one "
      "thread, the widest vectors and no queries: other numbers give about 1, as noise does.",
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
    for (std::size_t k = 0; k < number_count; ++k) {
      if (!a.wanted(names[k])) continue;
      runs.emplace_back();
      for (const double factor : {0.5, 2.0}) {
        CostTable table = cost;
        const double own = get(cost, k);
        set(table, k, factor * own);
        runs.back().push_back({names[k], fmt::format("{:g} for {:g}", factor * own, own), table});
      }
    }
  }
  if (runs.empty()) throw common::Failure("--only: no number of cost_table.hpp has such a name");
  for (const std::string& file : files)
    if (!file.ends_with(".npy"))
      throw common::Failure(fmt::format("--files: found '{}', wanted .npy files", file));
  const std::vector<CostCase> cases = all_cases(a, files);
  if (cases.empty()) throw common::Failure("--max-objects: the least number of boxes is 1000");
  for (const std::vector<Variant>& variants : runs) {
    measure(variants, cases, a.rounds_of(8), results);
    results.show(variants.front().name);
  }
  return common::exit_done;
}

}  // namespace throng::bench
