#include "grid/recursion_scratch.hpp"

namespace throng::grid {

RecursionScratch::RecursionScratch(base::Memory& memory) noexcept
    : query_strip(memory),
      target_strip(memory),
      wide_strip(memory),
      clipped(memory),
      near_records(memory),
      segments(memory),
      starts(memory),
      space(memory),
      ids(memory),
      labels(memory),
      masks(memory) {}

void RecursionScratch::match(const RecursionScratch& other) {
  query_strip.match(other.query_strip);
  target_strip.match(other.target_strip);
  wide_strip.match(other.wide_strip);
  clipped.match(other.clipped);
  near_records.match(other.near_records);
  segments.match(other.segments);
  starts.match(other.starts);
  space.match(other.space);
  ids.match(other.ids);
  labels.match(other.labels);
  masks.match(other.masks);
}

}  // namespace throng::grid
