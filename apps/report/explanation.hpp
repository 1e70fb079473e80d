// The results of Finder::explain, as tables and as a part of a page.
#pragma once

#include <vector>

#include <throng/explain.hpp>

#include "apps/report/page.hpp"
#include "apps/report/table.hpp"

namespace throng::report {

// Algorithm and reason, counts, times.
Table explanation_summary(const Explanation& e);
// Sizes, the largest boxes, boxes per cell, the densest cells, memory; those that have rows.
std::vector<Table> explanation_details(const Explanation& e);
// Both, the suggestions between them, and two plots: boxes by size, cells by number of boxes.
void explain(Page& page, const Explanation& e);

}  // namespace throng::report
