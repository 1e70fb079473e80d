// Brute force: every pair of boxes, tile by tile.
#pragma once

#include <cstdint>

#include "grid/job.hpp"

namespace throng::grid {

// Boxes of one subset as floats, one array per coordinate. Inactive ones are all NaN: they overlap
// nothing.
class BoxTiles {
 public:
  static constexpr std::uint32_t tile_boxes = 256;

  explicit BoxTiles(base::Memory& memory) noexcept : floats_(memory), ids_(memory) {}
  void load(const Search&, const BoxSubset&, bool is_targets, BinReport&);
  void match(const BoxTiles& other) {
    floats_.match(other.floats_);
    ids_.match(other.ids_);
  }
  Tile tile(std::uint32_t index) const noexcept;
  std::uint32_t tile_count() const noexcept { return (count_ + tile_boxes - 1) / tile_boxes; }

 private:
  base::Buffer<float> floats_;
  base::Buffer<std::uint32_t> ids_;
  std::uint32_t count_ = 0;
  // Readable one tile beyond the last box.
  using Row = base::PaddedArray<float, tile_boxes>;
  Row corner_[6];
};

// Reads the boxes of a problem into the float arrays of the first worker.
BinReport load_all_pairs(const Job&);
// Finds the pairs of the loaded boxes.
void find_all_pairs(const Job&);

}  // namespace throng::grid
