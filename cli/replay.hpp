// What the two halves of `throng replay` share: a call of a Finder, and a BroadPhase's life.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <throng/boxes.hpp>

#include "cli/truth.hpp"
#include "scene/capture.hpp"

namespace throng::cli {

struct ReplayLimits {
  bool full = false;
  // Comparisons that a double loop may make; above that the algorithms are held against each other.
  double most_tests = 0;
};

struct ReplayReport {
  std::string text;             // for people, lines
  nlohmann::ordered_json json;  // for programs
  bool differs = false;
};

// One box by its numbers, in decimal and exactly.
std::string box_text(const Box& box);

// What is right: by the double loop, or where that is too much by the grid of columns, on one
// thread with the plain instruction set; `by` says which.
Truth make_truth(const Boxes& a, const Boxes* b, float margin, const ReplayLimits& limits,
                 const char*& by);

// The life of a BroadPhase, call by call, on several instruction sets and numbers of threads.
void replay_live(const scene::Capture& capture, const ReplayLimits& limits, ReplayReport& report);

}  // namespace throng::cli
