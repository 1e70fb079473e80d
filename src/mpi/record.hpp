// The wire format of a box, for host and device: 24 bytes of box, 8 of id, and 4 for each filter
// that some rank gives; ranks without that filter send a value that allows all.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <throng/boxes.hpp>

#include "base/host_device_macros.hpp"

namespace throng::mpi {

enum Present : unsigned {
  has_group = 1,
  has_mask = 2,
  has_owner = 4,
  has_world = 8,
  has_static = 16
};

inline unsigned present(const Filters& f) noexcept {
  return (f.group ? has_group : 0u) | (f.mask ? has_mask : 0u) | (f.owner ? has_owner : 0u) |
         (f.world ? has_world : 0u) | (f.is_static ? has_static : 0u);
}

inline std::size_t record_bytes(unsigned filters) noexcept {
  return sizeof(Box) + sizeof(std::uint64_t) + 4 * static_cast<std::size_t>(std::popcount(filters));
}

// All four bytes are set, so it is independent of byte order.
THRONG_HD constexpr std::uint32_t static_word(bool is_static) noexcept {
  return is_static ? 0x01010101u : 0u;
}

}  // namespace throng::mpi
