// Conservative occupancy of blocks of cells (core/blocks.hpp) for moving boxes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/blocks.hpp"
#include "live/cell_map.hpp"
#include "live/list.hpp"

namespace throng::live {

class Blocks {
 public:
  static constexpr int levels = core::BlockBits::levels;
  static constexpr std::int32_t length(int level) noexcept {
    return core::BlockBits::length(level);
  }

  explicit Blocks(cpu::Memory& memory) noexcept : words_(memory) {}

  // Clears; allocates bits for this many boxes. Throws cpu::NoMemory.
  void make(std::size_t boxes) {
    forget();
    const std::size_t count = core::BlockBits::words_for(boxes);
    words_.renew(count);
    words_.resize(count);
    std::fill(words_.begin(), words_.end(), 0u);
    bits_ = {words_.data(), count};
    left_ = 2 * boxes + 1;
  }
  void forget() noexcept { words_.clear(); }
  bool made() const noexcept { return !words_.empty(); }
  // More boxes were added than the bits were sized for.
  bool worn() const noexcept { return made() && left_ == 0; }

  // Marks the cell that holds a box of this class.
  void add(const CellMap::Range& cell, int size_class) noexcept {
    left_ -= left_ != 0;
    bits_.add(cell.lower, static_cast<std::uint32_t>(size_class),
              [](std::uint32_t* word, std::uint32_t bits) { *word |= bits; });
  }
  bool any(const CellMap::Range& cells, int size_class, int level) const noexcept {
    return bits_.any(cells.lower, cells.upper, static_cast<std::uint32_t>(size_class), level);
  }

 private:
  List<std::uint32_t> words_;
  core::BlockBits bits_;
  std::size_t left_ = 0;  // boxes until the bits are too dense
};

}  // namespace throng::live
