// Sibling programs in the same folder: throng-bench, throng-paper, throng-simulate.
#pragma once

#include <string>

namespace throng::common {

// The path of `program` in the running program's folder; empty if it is not there.
std::string find_sibling_program(const std::string& program);

}  // namespace throng::common
