// Becomes another program, one that stands beside this one (program/companion.hpp).
#pragma once

#include <string>
#include <vector>

namespace throng::cli {

// Becomes that program with these arguments (on Windows: runs it and gives its status).
// Returns only on Windows; throws Failure where it cannot be started.
int start_companion(const std::string& path, const std::vector<std::string>& arguments);

}  // namespace throng::cli
