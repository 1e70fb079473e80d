// What one thread does of update_boxes: a body's box, and a word of a shape that is wrong.
#pragma once

#include <cstdint>

#include <throng/cuda.hpp>

#include "core/update_boxes.hpp"
#include "pipeline/atomic.hpp"

namespace throng::pipeline {

struct UpdateBodies {
  core::UpdateBoxes job;
  cuda::BodyReport* report;  // cleared; null: nobody asks

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (job(i) == core::ShapeFault::none || !report) return;
    fetch_add(&report->bad_shapes, std::uint64_t{1});
    fetch_max(&report->bad_shape_mark, ~static_cast<std::uint32_t>(i));
  }
};

}  // namespace throng::pipeline
