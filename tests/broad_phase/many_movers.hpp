// Objects of which enough move in each frame for a parallel incremental search; some are large,
// with hundreds of pairs each.
#pragma once

#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {

struct ManyMovers {
  static constexpr std::size_t objects = 40000, large_every = 500;

  BoxList boxes = uniform_boxes(static_cast<int>(objects), 3);
  std::vector<ObjectId> ids;  // of the moving objects
  BoxList moved;
  Random random{11};

  ManyMovers() {
    for (std::size_t i = 0; i < objects; i += large_every) boxes[i] = cube(boxes[i].lower, side(i));
  }
  static float side(std::size_t i) {
    return i % large_every != 0 ? 1.0f : i % (2 * large_every) == 0 ? 20.0f : 12.0f;
  }
  void move() {
    ids.clear();
    moved.clear();
    for (std::size_t i = random.below(83); i < objects; i += 83) {
      const Vec3 at = boxes[i].lower, by = random.point(-0.5f, 0.5f);
      boxes[i] = cube({at.x + by.x, at.y + by.y, at.z + by.z}, side(i));
      ids.push_back(static_cast<ObjectId>(i));
      moved.push_back(boxes[i]);
    }
  }
  std::vector<Pair> pairs() const {
    Options canonical;
    canonical.order = Order::canonical;
    canonical.inverted = InvertedPolicy::inactive;
    return find_pairs(boxes, canonical);
  }
};

}  // namespace throng::tests
