#include "grid/recursion_scratch.hpp"

namespace throng::grid {

void StripStorage::assign_storage(Strip& strip, bool with_classes) {
  using Coordinates = Strip::Array<std::int16_t>;
  using Masks = Strip::Array<RejectMask>;
  const std::uint32_t count = strip.count;
  std::int16_t* const of_boxes = coordinates.ensure(6 * Coordinates::row_elements(count));
  for (std::size_t k = 0; k < 3; ++k) {
    strip.lower[k] = Coordinates::row(of_boxes, 2 * k, count);
    strip.upper[k] = Coordinates::row(of_boxes, 2 * k + 1, count);
  }
  RejectMask* const of_sides = masks.ensure((with_classes ? 2 : 1) * Masks::row_elements(count));
  strip.target_mask = Masks::row(of_sides, 0, count);
  strip.query_mask = Masks::row(of_sides, with_classes ? 1 : 0, count);
  strip.id = {ids, count};
}

void StripStorage::match(const StripStorage& other) {
  order.match(other.order);
  ranks.match(other.ranks);
  coordinates.match(other.coordinates);
  masks.match(other.masks);
  ids.match(other.ids);
  buckets.match(other.buckets);
}

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
