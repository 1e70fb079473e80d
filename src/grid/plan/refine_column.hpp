// Searches a column with a grid of its own where a sweep would be slow.
#pragma once

#include <cstdint>

#include "grid/bin/grid.hpp"

namespace throng::grid {

// Solves a column's strips a (queries) and b (targets) by a finer grid if that should be much
// faster than sweeping. Else returns false and does nothing.
bool refine(Search&, const Problem&, Worker&, const Strip& a, const Strip& b, unsigned depth);

}  // namespace throng::grid
