// Boxes of bodies on the CPU: vectorized blocks of bodies, distributed over threads.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

#include "base/cancellation.hpp"
#include "base/update_boxes.hpp"

namespace throng::bodies {

struct BodyReport {
  std::uint64_t first_invalid = 0, invalid_count = 0;
};

// Computes the boxes of `job` for bodies 0 .. count-1 on up to `tasks` tasks. The arithmetic is
// that of base::UpdateBoxes, so every instruction set gives the same bits, and an unavailable one
// falls back to another. Once `stop` is true some boxes stay unwritten.
BodyReport update_boxes(const base::UpdateBoxes& job, std::size_t count, Isa isa,
                        const Executor& executor, unsigned tasks,
                        base::Cancellation& stop) noexcept;

// A block of bodies with box shapes, one array per coordinate.
struct BodyBlock {
  static constexpr std::size_t size = 64;
  alignas(64) float position[3][size];
  alignas(64) float rotation[4][size];
  alignas(64) float displacement[3][size];
  alignas(64) float center[3][size];
  alignas(64) float half_extents[3][size];
  alignas(64) float radius[size];
  alignas(64) float lower[3][size], upper[3][size];
};
// Writes lower and upper of the whole block.
using BlockKernel = void (*)(BodyBlock&, float margin);
BlockKernel find_block_kernel(Isa, bool rotated, bool displaced) noexcept;

}  // namespace throng::bodies
