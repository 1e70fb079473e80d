// The checksum of a set of pairs, and the mixing function of the scene generators.
#pragma once

#include <throng/checksum.hpp>

namespace throng::scenes {

using throng::pair_checksum;
constexpr std::uint64_t mix(std::uint64_t x) noexcept { return mix64(x); }

}  // namespace throng::scenes
