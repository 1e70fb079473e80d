// Result fields of a device search, the same for boxes in host and in device memory.
#pragma once

#include <throng/options.hpp>

#include "device/input.hpp"

namespace throng::device {

inline void set_plan(bool brute, Result& r) noexcept {
  r.plan.algorithm = brute ? Algorithm::all_pairs : Algorithm::grid;
  r.plan.reason = brute ? "brute force by tiles: few boxes, or requested"
                        : "cells by size classes, from a sample of the boxes";
}

// Once the boxes have been read: sets the reason if they were searched world by world.
inline void set_worlds_reason(bool brute, const Report& report, const Input& in,
                              Result& r) noexcept {
  if (!brute && in.has_worlds && report.active == 0 && report.inactive < in.count)
    r.plan.reason = "brute force in each world: they are small, and their boxes stand together";
}

// Copies the counts of inactive boxes. Returns false, with status and index, if a NaN is refused.
// `in_second_set`: whether that index is of the second set.
inline bool accept(const Report& report, const Input& in, NanPolicy policy, Result& r,
                   bool& in_second_set) noexcept {
  r.inactive = report.inactive;
  if (policy != NanPolicy::refuse || report.nan_count == 0) return true;
  r.inactive -= report.nan_count;
  r.invalid_count = report.nan_count;
  in_second_set = in.two_sets && in.in_second(report.first_nan());
  r.first_invalid = in.local(report.first_nan());
  r.status = Status::nan_box;
  return false;
}

}  // namespace throng::device
