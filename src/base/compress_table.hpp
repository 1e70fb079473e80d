// Lane indices for each byte mask: for instruction sets without a compress instruction.
#pragma once

#include <cstdint>

namespace throng::base {

struct CompressTable {
  std::uint8_t lanes[256][8] = {};  // positions of the set bits in order, then zeros
  constexpr CompressTable() {
    for (unsigned bits = 0; bits < 256; ++bits) {
      unsigned count = 0;
      for (unsigned lane = 0; lane < 8; ++lane) {
        if (bits >> lane & 1) lanes[bits][count++] = static_cast<std::uint8_t>(lane);
      }
    }
  }
};
inline constexpr CompressTable compress_table;

}  // namespace throng::base
