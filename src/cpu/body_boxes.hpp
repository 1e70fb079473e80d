// Boxes of bodies on the CPU: blocks of bodies as vectors, shared out among threads.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

#include "core/update_boxes.hpp"
#include "cpu/stop.hpp"

namespace throng::cpu {

struct BodyReport {
  std::uint64_t first_invalid = 0, invalid_count = 0;
};

// Box by box what `job` says, of bodies 0 .. count-1, by so many tasks; by the very same
// arithmetic. An instruction set that is not here does as well as another: the bits are the same.
// Once `stop` is true some boxes stay as they were.
BodyReport update_boxes(const core::UpdateBoxes& job, std::size_t count, Isa isa,
                        const Executor& executor, unsigned tasks, Stop& stop) noexcept;

// A block of bodies with box shapes, an array a coordinate.
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
// Fills in lower and upper of the whole block.
using PlaceBlock = void (*)(BodyBlock&, float margin);
PlaceBlock find_place_block(Isa, bool rotated, bool displaced) noexcept;

}  // namespace throng::cpu
