// The output of throng-paper pairs, as text and as JSON.
#pragma once

#include <cstdint>
#include <string>

#include "apps/paper/input.hpp"
#include "apps/paper/variant.hpp"

namespace throng::paper {

// Sums over the frames.
struct Outcome {
  std::uint64_t pairs = 0, checksum = 0, missing = 0, extra = 0;
  std::uint64_t output_bytes = 0, cells = 0, entries = 0;
  Times times;
  MappingErrors errors;
};

struct Report {
  Variant variant;
  DeviceKind device = DeviceKind::cpu;
  int repeat = 1;
  bool check = false;  // missing and extra are known
};

std::string to_json(const Report& a, const Boxes& boxes, const Outcome& o);
std::string to_text(const Report& a, const Boxes& boxes, const Outcome& o);

}  // namespace throng::paper
