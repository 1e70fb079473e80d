// A column that a sweep would be slow in is searched by a grid of its own.
#pragma once

#include <cstdint>

#include "cpu/grid.hpp"

namespace throng::cpu {

// Solves what a column holds (strips a and b, of the queries and the targets) by a finer grid,
// where that promises to be much faster than sweeping; false where it does not, and nothing was
// done.
bool refine(Search&, const Problem&, Worker&, const Strip& a, const Strip& b, unsigned depth);

}  // namespace throng::cpu
