// The per-thread work of update_boxes: computes a body's box and reports an invalid shape.
#pragma once

#include <cstdint>

#include <throng/cuda.hpp>

#include "core/update_boxes.hpp"
#include "pipeline/atomic.hpp"

namespace throng::pipeline {

struct UpdateBodies {
  core::UpdateBoxes job;
  cuda::BodyReport* report;  // zeroed; null: no report

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (job(i) == core::ShapeFault::none || !report) return;
    fetch_add(&report->bad_shapes, std::uint64_t{1});
    fetch_max(&report->bad_shape_mark, ~static_cast<std::uint32_t>(i));
  }
};

}  // namespace throng::pipeline
