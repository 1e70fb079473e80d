// Are the pairs still those that they always were, to the byte, whatever finds them?
#pragma once

#include <cstddef>

namespace throng::bench {

// Holds every way to find the pairs of scenes up to `most_objects` against scene/golden.hpp, and
// tells of each. Gives the number of those that differ.
int validate(std::size_t most_objects);
// Prints the table of scene/golden.cpp as it is here and now.
void print_golden();

}  // namespace throng::bench
