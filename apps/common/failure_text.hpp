// Messages for failed library calls, with the fixes that a command offers.
#pragma once

#include <string>

#include <throng/options.hpp>

namespace throng::common {

// Which options of the command help. The library's own hints name its C++ API.
struct HintOptions {
  bool nan = false;       // --nan inactive
  bool inverted = false;  // --inverted inactive
  bool memory = false;    // --memory
  bool backend = false;   // --backend
  std::string isa = {};   // the instruction set that --isa names; empty: none
};

// The problem in the library's words, and the fix in the command's.
std::string failure_text(const Result& result, const HintOptions& hint_options);

}  // namespace throng::common
