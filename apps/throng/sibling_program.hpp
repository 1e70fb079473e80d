// Replaces this process by a sibling program (apps/common/sibling_program.hpp).
#pragma once

#include <string>
#include <vector>

namespace throng::cli {

// Replaces this process by that program with these arguments; returns only on Windows, where it
// runs the program and returns its status. Throws Failure when it cannot be started.
int run_sibling_program(const std::string& path, const std::vector<std::string>& arguments);

}  // namespace throng::cli
