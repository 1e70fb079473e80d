// Conservative occupancy bits for blocks of 8, 64, 512 and 4,096 cells along each axis. A block is
// marked when a box has its storage cell in it. Hashing maps a block to a bit, so several blocks
// may share one, and removing a box clears nothing: false positives occur, false negatives never.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "base/host_device_macros.hpp"

namespace throng::base {

// A view of the bits. The caller owns the memory and zeroes it before the first add().
class BlockBitmap {
 public:
  static constexpr int levels = 4;
  // Cells along one edge of a block of this level, 1 .. levels.
  THRONG_HD static constexpr std::int32_t length(int level) noexcept { return 1 << 3 * level; }
  // Number of 32-bit words for the blocks of `boxes` boxes.
  static std::size_t words_for(std::size_t boxes) noexcept {
    return std::bit_ceil(std::max<std::size_t>(16 * boxes, 1024)) / 32;
  }

  BlockBitmap() noexcept = default;
  // `count` is what words_for() returned.
  BlockBitmap(std::uint32_t* words, std::size_t count) noexcept
      : words_(words), hash_shift_(64 - 5 - std::countr_zero(count)) {}

  // Calls put(word, bits) for each bit to set for a box of this class with this storage cell.
  template <class Put>
  THRONG_HD void add(const std::int32_t* cell, std::uint32_t size_class,
                     const Put& put) const noexcept {
    for (int level = 1; level <= levels; ++level) {
      const int s = 3 * level;
      const std::uint64_t bit = number(cell[0] >> s, cell[1] >> s, cell[2] >> s, size_class, level);
      put(words_ + bit / 32, 1u << bit % 32);
    }
  }
  // Whether one of the cells `lower` .. `upper` may be a storage cell, by the blocks of `level`.
  // Returns true without a test when the range covers more than `max_tested_blocks` blocks.
  THRONG_HD bool may_contain(const std::int32_t* lower, const std::int32_t* upper,
                             std::uint32_t size_class, int level) const noexcept {
    std::int32_t first[3], last[3];
    std::int64_t count = 1;
    for (int k = 0; k < 3; ++k) {
      first[k] = lower[k] >> 3 * level;
      last[k] = upper[k] >> 3 * level;
      const std::int64_t n = std::int64_t{last[k]} - first[k] + 1;
      count *= n < max_tested_blocks ? n : max_tested_blocks + 1;
    }
    if (count > max_tested_blocks) return true;
    for (std::int32_t z = first[2]; z <= last[2]; ++z) {
      for (std::int32_t y = first[1]; y <= last[1]; ++y) {
        for (std::int32_t x = first[0]; x <= last[0]; ++x) {
          const std::uint64_t bit = number(x, y, z, size_class, level);
          if (words_[bit / 32] >> bit % 32 & 1) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr std::int64_t max_tested_blocks = 32;

  THRONG_HD std::uint64_t number(std::int32_t x, std::int32_t y, std::int32_t z,
                                 std::uint32_t size_class, int level) const noexcept {
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u +
                      static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu +
                      static_cast<std::uint64_t>(z) * 0x165667b19e3779f9u +
                      (std::uint64_t{size_class} * (levels + 1) + static_cast<unsigned>(level)) *
                          0xd6e8feb86659fd93u;
    h = (h ^ h >> 32) * 0xd6e8feb86659fd93u;
    return h >> hash_shift_;
  }

  std::uint32_t* words_ = nullptr;
  int hash_shift_ = 0;
};

}  // namespace throng::base
