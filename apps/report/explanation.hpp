// The results of Finder::explain, as tables and as a part of a page.
#pragma once

#include <vector>

#include <throng/explain.hpp>

#include "apps/report/page.hpp"
#include "apps/report/plot.hpp"
#include "apps/report/table.hpp"

namespace throng::report {

// Counts, times, method and reason, tests, memory.
Table explanation_summary(const Explanation& e);
// Boxes by size, cells by number of boxes; those that have bars.
std::vector<Bars> explanation_histograms(const Explanation& e);
// The largest boxes, if sizes differ much; the cells with the most boxes, if there are cells.
std::vector<Table> explanation_details(const Explanation& e);
// All of it and the suggestions.
void explain(Page& page, const Explanation& e);

}  // namespace throng::report
