// Makes a problem's plan from a sample of its boxes.
#pragma once

#include <cstdint>

#include "grid/plan/planner.hpp"
#include "grid/search.hpp"

namespace throng::grid {

// Number of boxes sampled for a plan.
constexpr std::uint32_t sample_size(std::uint64_t boxes) noexcept {
  return boxes < 4096 ? 64 : (boxes < 65536 ? 256 : max_sample);
}
// The statistics of a problem's boxes, from a sample.
Stats sample_stats(const Search&, const Problem&);
// Plans from a sample of a problem's boxes.
GridPlan make_plan(const Search&, const Problem&, Algorithm forced);

}  // namespace throng::grid
