// The measurements of the search subcommand as tables, rows, JSON and an HTML page.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <throng/explain.hpp>

#include "apps/report/page.hpp"
#include "apps/report/table.hpp"
#include "bench/results.hpp"
#include "bench/search_rounds.hpp"

namespace throng::bench {

struct Bandwidth {
  unsigned threads;
  double gb_per_s;
};

struct Findings {
  std::vector<std::pair<std::string, std::string>> machine;
  std::vector<Bandwidth> bandwidth;
  std::vector<Measurement> measurements;
  // By the label of the scene, at its largest size.
  std::map<std::string, Explanation> explanations;
};

report::Table machine_table(const Findings& f);
// All methods on one scene at one size.
report::Table case_table(const Findings& f, const std::string& scene, std::size_t objects);
// One line per scene and size: Throng and the fastest other library. If there would be more than
// `most_rows`, only the largest size of each scene.
report::Table summary_table(const Findings& f, std::size_t most_rows);
std::vector<Row> rows(const Findings& f);
std::string json(const Findings& f);
report::Page page(const Findings& f);
// One line per method that found other pairs; empty if all agree.
std::vector<std::string> disagreements(const Findings& f);

}  // namespace throng::bench
