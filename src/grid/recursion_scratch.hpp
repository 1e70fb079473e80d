// What a worker keeps for the grid at one recursion depth.
#pragma once

#include <cstdint>

#include "base/memory.hpp"
#include "grid/bin/grid.hpp"
#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {

// Storage of a Strip's arrays.
class StripStorage {
 public:
  explicit StripStorage(base::Memory& memory) noexcept
      : order(memory),
        ranks(memory),
        coordinates(memory),
        masks(memory),
        ids(memory),
        buckets(memory) {}
  // Points the arrays of `strip` at storage for strip.count boxes. with_classes: query and target
  // bits differ.
  void assign_storage(Strip& strip, bool with_classes);
  void match(const StripStorage& other);

  base::Buffer<const Record*> order;
  base::Buffer<std::uint32_t> ranks;
  base::Buffer<std::int16_t> coordinates;
  base::Buffer<RejectMask> masks;
  base::Buffer<std::uint32_t> ids;
  base::Buffer<std::uint32_t> buckets;
};

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
