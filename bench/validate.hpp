// Compares the pairs with a stored table, byte by byte, for every way to find them.
#pragma once

#include <cstddef>

namespace throng::bench {

// Compares every way to find the pairs of scenes up to `most_objects` with apps/scenes/golden.hpp
// and prints each. Returns the number of differences.
int validate(std::size_t most_objects);
// Prints the table of apps/scenes/golden.cpp for the current build.
void print_golden();

}  // namespace throng::bench
