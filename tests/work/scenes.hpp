// Scenes that are hard for a search by cells or by a tree. Each family draws its parameters from a
// seed, so that a bound on work holds for the family and not for one input.
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
  // Filters, one value per box; empty: none.
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;
  // The objects that move when few do; all of them each frame, by up to `step` of their size or,
  // with `teleport`, to another object's place.
  std::vector<ObjectId> movers;
  float step = 0.25f;
  bool teleport = false;
  // Before anything is measured, objects move here, a hundredth per frame; then `removed` are
  // removed.
  std::vector<Box> unpacked;
  std::vector<ObjectId> removed;
  // Pairs that filters forbid are found and dropped (documented), so the bound counts them as
  // results.
  bool pays_for_forbidden = false;
  // Queries are of all worlds, which are many: documented to test all objects, so n is their
  // budget.
  bool queries_test_all = false;
  // Number of objects that a straight line through the scene passes, to the order of magnitude.
  double path_objects = 1;

  Boxes view() const;
};

// All families, in the order of the table of bounds.
const std::vector<std::string>& work_families();

// About n boxes; fewer in families with quadratically many pairs.
WorkScene make_work_scene(const std::string& family, std::uint32_t n, std::uint64_t seed);

}  // namespace throng::tests
