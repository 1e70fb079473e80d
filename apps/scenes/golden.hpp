// The expected pairs of the scenes, the same on every machine, compiler, instruction set, thread
// count and backend. Printed by the library itself, so they only show stability; golden_test
// compares the rows of up to 10,000 boxes with the double loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/types.hpp>

namespace throng::scenes {

struct Golden {
  const char* scene;  // seed 1, the default density, all boxes moving; its worlds as filters
  std::size_t frame, objects;
  std::uint64_t pairs;
  std::uint64_t checksum;   // pair_checksum
  std::uint64_t canonical;  // sequence_checksum of the sorted pairs
};

// By scene, then by number of objects.
const std::vector<Golden>& golden();

// A checksum that depends on the order of the pairs.
std::uint64_t sequence_checksum(const Pair* pairs, std::size_t count) noexcept;

}  // namespace throng::scenes
