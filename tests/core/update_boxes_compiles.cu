// The function object of update_boxes as a kernel: that it compiles for a device, with what it
// calls, and that a launcher needs no more than this.
#include <cstddef>
#include <type_traits>

#include "core/update_boxes.hpp"

namespace throng::tests {

static_assert(std::is_trivially_copyable_v<core::UpdateBoxes>, "it is a kernel's argument");

// `first_invalid` starts as count, `invalid_count` as 0.
__global__ void update_boxes(core::UpdateBoxes job, std::size_t count,
                             unsigned long long* first_invalid, unsigned long long* invalid_count) {
  const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i >= count || job(i) == core::ShapeFault::none) return;
  atomicMin(first_invalid, static_cast<unsigned long long>(i));
  atomicAdd(invalid_count, 1ull);
}

}  // namespace throng::tests
