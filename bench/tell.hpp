// What was measured, as tables, CSV, JSON and a page.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <throng/explain.hpp>
#include "bench/measure.hpp"

#include "report/page.hpp"
#include "report/table.hpp"

namespace throng::bench {

struct Bandwidth {
  unsigned threads;
  double gb_per_s;
};

struct Findings {
  std::vector<std::pair<std::string, std::string>> machine;
  std::vector<Bandwidth> bandwidth;
  std::vector<Row> rows;
  // Of each scene, by its label, at its largest size: why Throng takes what it takes.
  std::map<std::string, Explanation> explanations;
};

// Bytes that must move: 24 a box in and 8 a pair out.
double information_floor_ms(std::size_t objects, std::uint64_t pairs, double gb_per_s);
// Bytes that one out-of-place counting sort and a scan move, 164 a box: read for the range 24; read
// for the cell 24 and its number written 4; read again 24 and 4, a record of 28 written, its line
// fetched before that, 28; the scan reads 28.
double sort_floor_ms(std::size_t objects, double gb_per_s);

report::Table machine_table(const Findings& f);
// All contenders on one scene at one size.
report::Table case_table(const Findings& f, const std::string& scene, std::size_t objects);
// One line a scene and size: Throng beside the fastest rival, the better plain grid, the floor.
report::Table summary_table(const Findings& f);
// Whether the plain grids are good enough to be yardsticks.
report::Table yardstick_table(const Findings& f);
report::Table all_rows(const Findings& f);
std::string json(const Findings& f);
report::Page page(const Findings& f);
// One line for each contender that found something else; empty where all agree.
std::vector<std::string> disagreements(const Findings& f);

}  // namespace throng::bench
