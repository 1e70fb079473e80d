// Which blocks of cells boxes have their home in: blocks of 8, 64, 512 and 4,096 cells along each
// axis. A bit is found by a hash, so it may stand for several; and it stays when boxes go. So it is
// said of all blocks that hold a home, and of a few that do not.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "live/cell_map.hpp"
#include "live/list.hpp"

namespace throng::live {

class Blocks {
 public:
  static constexpr int levels = 4;
  // A block of a level, from 1 on, is so many cells long.
  static constexpr std::int32_t length(int level) noexcept { return 1 << 3 * level; }

  explicit Blocks(cpu::Memory& memory) noexcept : words_(memory) {}

  // None yet; bits for so many boxes. Throws cpu::NoMemory.
  void make(std::size_t boxes) {
    forget();
    const std::size_t bits = std::bit_ceil(std::max<std::size_t>(16 * boxes, 1024));
    words_.renew(bits / 64);
    words_.resize(bits / 64);
    std::fill(words_.begin(), words_.end(), 0);
    drop_ = 64 - std::countr_zero(bits);
    left_ = 2 * boxes + 1;
  }
  void forget() noexcept { words_.clear(); }
  bool made() const noexcept { return !words_.empty(); }
  // More boxes have come than bits were made for.
  bool worn() const noexcept { return made() && left_ == 0; }

  // The home of a box of this class.
  void add(const CellMap::Range& cell, int size_class) noexcept {
    left_ -= left_ != 0;
    for (int level = 1; level <= levels; ++level) {
      const int s = 3 * level;
      const std::uint64_t bit =
          number(cell.lower[0] >> s, cell.lower[1] >> s, cell.lower[2] >> s, size_class, level);
      words_[bit / 64] |= std::uint64_t{1} << bit % 64;
    }
  }
  // Whether one of these cells may be a home, going by blocks of a level; of many it is said.
  bool any(const CellMap::Range& cells, int size_class, int level) const noexcept {
    std::int32_t first[3], last[3];
    std::int64_t count = 1;
    for (int k = 0; k < 3; ++k) {
      first[k] = cells.lower[k] >> 3 * level;
      last[k] = cells.upper[k] >> 3 * level;
      count *= std::min<std::int64_t>(std::int64_t{last[k]} - first[k] + 1, most + 1);
    }
    if (count > most) return true;
    for (std::int32_t z = first[2]; z <= last[2]; ++z) {
      for (std::int32_t y = first[1]; y <= last[1]; ++y) {
        for (std::int32_t x = first[0]; x <= last[0]; ++x) {
          const std::uint64_t bit = number(x, y, z, size_class, level);
          if (words_[bit / 64] >> bit % 64 & 1) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr std::int64_t most = 32;

  std::uint64_t number(std::int32_t x, std::int32_t y, std::int32_t z, int size_class,
                       int level) const noexcept {
    const auto wide = [](std::int32_t i) { return static_cast<std::uint64_t>(i); };
    std::uint64_t h = wide(x) * 0x9e3779b97f4a7c15u + wide(y) * 0xc2b2ae3d27d4eb4fu +
                      wide(z) * 0x165667b19e3779f9u +
                      wide(size_class * (levels + 1) + level) * 0xd6e8feb86659fd93u;
    h = (h ^ h >> 32) * 0xd6e8feb86659fd93u;
    return h >> drop_;
  }

  List<std::uint64_t> words_;
  int drop_ = 0;
  std::size_t left_ = 0;  // so many may still come
};

}  // namespace throng::live
