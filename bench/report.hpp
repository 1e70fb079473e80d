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

// The time to move 164 bytes per box, which one out-of-place counting sort and a scan need: 24 to
// find the range; 24 to find the cell and 4 to write its number; 24 and 4 again, 28 to write a
// record and 28 to fetch its cache lines first; 28 for the scan.
double sort_floor_ms(std::size_t objects, double gb_per_s);

report::Table machine_table(const Findings& f);
// All methods on one scene at one size.
report::Table case_table(const Findings& f, const std::string& scene, std::size_t objects);
// One line per scene and size: Throng, the fastest other library, the faster baseline grid, the
// floor.
report::Table summary_table(const Findings& f);
std::vector<Row> rows(const Findings& f);
std::string json(const Findings& f);
report::Page page(const Findings& f);
// One line per method that found other pairs; empty if all agree.
std::vector<std::string> disagreements(const Findings& f);

}  // namespace throng::bench
