// What the two parts of `throng replay` share: the calls of a Finder and of a BroadPhase.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <throng/boxes.hpp>

#include "apps/scenes/capture.hpp"
#include "apps/throng/expected_pairs.hpp"

namespace throng::cli {

struct ReplayLimits {
  bool full = false;
  // Most comparisons of a double loop; above it the algorithms are compared with each other.
  double max_tests = 0;
};

struct ReplayReport {
  std::string text;             // text, line by line
  nlohmann::ordered_json json;  // JSON
  bool differs = false;
};

// One box, in decimal and exactly.
std::string box_text(const Box& box);

// The expected result: from the double loop, or where that takes too long from the grid on one
// thread with the scalar kernels; `by` says which.
ExpectedPairs make_expected_pairs(const Boxes& a, const Boxes* b, float margin,
                                  const ReplayLimits& limits, const char*& by);

// The calls of a BroadPhase in sequence, on several instruction sets and thread counts.
void replay_broad_phase(const scenes::Capture& capture, const ReplayLimits& limits,
                        ReplayReport& report);

}  // namespace throng::cli
