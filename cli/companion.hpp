// Programs that stand beside this one: throng-bench, throng-paper.
#pragma once

#include <string>
#include <vector>

namespace throng::cli {

// The path of `program` in the folder of the running program; empty where there is none.
std::string find_companion(const std::string& program);
// Becomes that program with these arguments (on Windows: runs it and gives its status).
// Returns only on Windows; throws Failure where it cannot be started.
int start_companion(const std::string& path, const std::vector<std::string>& arguments);

}  // namespace throng::cli
