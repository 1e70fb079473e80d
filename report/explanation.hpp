// What Finder::explain tells, as tables, and as a part of a page.
#pragma once

#include <vector>

#include <throng/explain.hpp>

#include "report/page.hpp"
#include "report/table.hpp"

namespace throng::report {

// Algorithm and reason, counts, times.
Table explanation_summary(const Explanation& e);
// Sizes, the largest boxes, how full cells are, the densest ones, memory; those that have rows.
std::vector<Table> explanation_details(const Explanation& e);
// Both, what would make it faster between them, and two plots: boxes by size, cells by fullness.
void explain(Page& page, const Explanation& e);

}  // namespace throng::report
