// The input of a sweep: the boxes of a column, in the order in which they are swept.
#pragma once

#include <cstdint>

#include "base/padded_array.hpp"
#include "grid/emit/pair_output.hpp"
#include "grid/sweep/record.hpp"

namespace throng::grid {

// A column's boxes as structure of arrays, ordered by their lower coordinate on the sweep axis to
// the precision of a bucket. Axis 0 is the sweep axis. No padding entry matches.
struct Strip {
  static constexpr std::uint32_t padding = 128, record_padding = 32;
  template <class T>
  using Array = base::PaddedArray<T, padding>;

  std::uint32_t count = 0;
  std::uint32_t shift = 0;  // bucket = (coordinate >> shift) - first_bucket
  std::uint32_t first_bucket = 0, bucket_count = 0;
  Array<std::int16_t> lower[3], upper[3];
  // The masks of the boxes as targets and as queries: one array unless there are filters.
  Array<RejectMask> target_mask, query_mask;
  Array<std::uint32_t> id;
  // The same boxes as records, with axes in spatial order.
  base::PaddedArray<const Record*, record_padding> record;
  std::uint32_t axis = 0;  // the sweep axis in space
  const std::uint32_t* bucket_end = nullptr;
  // Every box is at least one bucket long on the sweep axis. Then no box of the strip ends before a
  // later one starts, so one of the two comparisons on that axis is not needed.
  bool long_boxes = false;

  std::uint32_t bucket_of(int coordinate) const noexcept {
    return (static_cast<std::uint32_t>(coordinate) >> shift) - first_bucket;
  }
  // The least coordinate of a target's bucket.
  int bucket_start(std::uint32_t target) const noexcept { return lower[0][target] & -(1 << shift); }
  // Box i, with the sweep axis first.
  QuantizedBox box(std::uint32_t i) const noexcept {
    QuantizedBox box;
    for (int k = 0; k < 3; ++k) {
      box.lower[k] = static_cast<std::uint16_t>(lower[k][i]);
      box.upper[k] = static_cast<std::uint16_t>(upper[k][i]);
    }
    return box;
  }
};

struct SweepArgs {
  const Strip* queries = nullptr;
  const Strip* targets = nullptr;
  const std::uint32_t* start = nullptr;  // first target of each query; null: the next box
  Orientation orientation = Orientation::unordered;
  std::uint32_t begin = 0, end = ~0u;  // queries; multiples of sweep_piece, or the last
};
constexpr std::uint32_t sweep_piece = 256;

}  // namespace throng::grid
