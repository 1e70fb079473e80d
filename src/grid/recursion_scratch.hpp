// What a worker keeps for the grid at one recursion depth.
#pragma once

#include <cstdint>

#include "base/memory.hpp"
#include "grid/bin/grid.hpp"
#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {

// A worker's scratch memory at one recursion depth.
struct RecursionScratch {
  explicit RecursionScratch(base::Memory& memory) noexcept;
  void match(const RecursionScratch& other);

  StripStorage query_strip, target_strip, wide_strip;
  base::Buffer<Record> clipped;  // of wide_strip
  base::Buffer<Record>
      near_records;  // if one subset has few boxes in a column: the other's boxes near them
  base::Buffer<Segment> segments;
  std::uint32_t segment_count = 0;
  base::Buffer<std::uint32_t> starts;
  // For a problem that this worker solves alone: a column, or a world.
  BinnedGrid space;
  base::Buffer<std::uint32_t> ids, labels;  // the queries, then the targets
  base::Buffer<RejectMask> masks;
};

}  // namespace throng::grid
