// A bit mixer: selects the directory rank of an id, and the sampled box of each run.
#pragma once

#include <cstdint>

#include "base/host_device_macros.hpp"

namespace throng::mpi {

// The splitmix64 finaliser: maps 64 bits to 64 well-hash64 bits.
THRONG_HD constexpr std::uint64_t hash64(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

}  // namespace throng::mpi
