// The per-thread work of update_boxes: computes a body's box and reports an invalid shape.
#pragma once

#include <cstdint>

#include <throng/cuda.hpp>

#include "base/update_boxes.hpp"
#include "device/atomic.hpp"

namespace throng::device {

struct UpdateBodies {
  base::UpdateBoxes job;
  cuda::BodyReport* report;  // zeroed; null: no report

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (job(i) == base::ShapeFault::none || !report) return;
    fetch_add(&report->bad_shapes, std::uint64_t{1});
    fetch_max(&report->bad_shape_mark, ~static_cast<std::uint32_t>(i));
  }
};

}  // namespace throng::device
