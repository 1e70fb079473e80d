// Conservative occupancy of blocks of cells (base/block_bitmap.hpp) for moving boxes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "base/block_bitmap.hpp"
#include "tracking/cell_map.hpp"
#include "tracking/pod_vector.hpp"

namespace throng::tracking {

class BlockOccupancy {
 public:
  static constexpr int levels = base::BlockBitmap::levels;
  static constexpr std::int32_t length(int level) noexcept {
    return base::BlockBitmap::length(level);
  }

  explicit BlockOccupancy(base::Memory& memory) noexcept : words_(memory) {}

  // Clears; allocates bits for this many boxes. Throws base::AllocationFailed.
  void make(std::size_t boxes) {
    clear();
    const std::size_t count = base::BlockBitmap::words_for(boxes);
    words_.reserve_discard(count);
    words_.resize(count);
    std::fill(words_.begin(), words_.end(), 0u);
    bits_ = {words_.data(), count};
    left_ = 2 * boxes + 1;
  }
  void clear() noexcept { words_.clear(); }
  bool made() const noexcept { return !words_.empty(); }
  // More boxes were added than the bits were sized for.
  bool is_stale() const noexcept { return made() && left_ == 0; }

  // Marks the cell that holds a box of this class.
  void add(const CellMap::Range& cell, int size_class) noexcept {
    left_ -= left_ != 0;
    bits_.add(cell.lower, static_cast<std::uint32_t>(size_class),
              [](std::uint32_t* word, std::uint32_t bits) { *word |= bits; });
  }
  bool any(const CellMap::Range& cells, int size_class, int level) const noexcept {
    return bits_.may_contain(cells.lower, cells.upper, static_cast<std::uint32_t>(size_class),
                             level);
  }

 private:
  PodVector<std::uint32_t> words_;
  base::BlockBitmap bits_;
  std::size_t left_ = 0;  // boxes until the bits are too dense
};

}  // namespace throng::tracking
