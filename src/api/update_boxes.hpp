// The job of update_boxes(), on the host and on a device.
#pragma once

#include <cstddef>

#include <throng/options.hpp>
#include <throng/update_boxes.hpp>

#include "base/update_boxes.hpp"

namespace throng {

// Prepares the per-body job without reading the arrays' contents. False, with status and message,
// if the arguments are invalid.
bool make_job(const Bodies& bodies, Box* out, const UpdateOptions& options,
              std::size_t stride_bytes, base::UpdateBoxes& job, Result& r) noexcept;

}  // namespace throng
