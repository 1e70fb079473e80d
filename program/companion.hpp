// Programs that stand beside this one: throng-bench, throng-paper, throng-simulate.
#pragma once

#include <string>

namespace throng::program {

// The path of `program` in the folder of the running program; empty where there is none.
std::string find_companion(const std::string& program);

}  // namespace throng::program
