// Scenes for which a search by cells or by a tree can lose its way: each family draws its
// parameters from a seed, so that a bound on work holds for the family and not for one input.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <throng/throng.hpp>

namespace throng::tests {

struct WorkScene {
  std::string family;
  std::uint64_t seed = 0;
  std::vector<Box> boxes;
  // Filters, one value a box; empty: none.
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;
  // Who moves where few do; each frame all of them, by up to `step` of their size, or where
  // `teleport` is set into another object's place.
  std::vector<ObjectId> movers;
  float step = 0.25f;
  bool teleport = false;
  // Before anything is measured: objects go here, a hundredth a frame; and then these are removed.
  std::vector<Box> unpacked;
  std::vector<ObjectId> removed;
  // Pairs that filters forbid are found and dropped: documented, so a bound counts them as results.
  bool pays_for_forbidden = false;
  // Queries are of all worlds, which are many: documented to look at all objects, so n is their
  // share.
  bool queries_look_at_all = false;
  // How many objects' places a straight line through the scene passes, to the order.
  double way = 1;

  Boxes view() const;
};

// All families, in the order of the table of bounds.
const std::vector<std::string>& work_families();

// About n boxes, fewer in families whose pairs grow with the square of n.
WorkScene make_work_scene(const std::string& family, std::uint32_t n, std::uint64_t seed);

}  // namespace throng::tests
