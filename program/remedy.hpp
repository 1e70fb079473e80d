// What the library says of a call that failed, with the remedies that a command has.
#pragma once

#include <string>

#include <throng/options.hpp>

namespace throng::program {

// Which options of a command help. The library's own words name its C++.
struct Remedies {
  bool nan = false;       // --nan inactive
  bool inverted = false;  // --inverted inactive
  bool memory = false;    // --memory
  bool backend = false;   // --backend
  std::string isa = {};   // the instruction set that --isa names; empty: none
};

// What is wrong, in the library's words, and what helps, in those of the command.
std::string failure_text(const Result& result, const Remedies& remedies);

}  // namespace throng::program
