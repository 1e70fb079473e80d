// Persistent objects in random motion, for the subcommands moving, queries and filters.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <throng/broad_phase.hpp>

#include "apps/scenes/scene.hpp"
#include "bench/competitors/moving.hpp"
#include "bench/require.hpp"

namespace throng::bench {

inline void start_with(BroadPhase& broad_phase, const std::vector<Box>& boxes) {
  require(broad_phase.add(boxes, nullptr));
  require(broad_phase.update());
}
inline void update(BroadPhase& broad_phase, const Moves& moves) {
  if (moves.all)
    require(broad_phase.move_all(*moves.all));
  else
    require(broad_phase.move(moves.ids.data(), moves.boxes));
  require(broad_phase.update());
}

// "1 % move", "all move".
inline std::string share_text(double share) {
  return share == 1 ? "all move" : fmt::format("{:g} % move", 100 * share);
}

// The first frame of a scene.
inline std::vector<Box> boxes_of(const std::string& scene, std::size_t objects) {
  scenes::Spec spec;
  spec.name = scene;
  spec.objects = objects;
  std::vector<Box> boxes(objects);
  scenes::Scene(spec).frame(0, boxes.data());
  return boxes;
}

// Each frame moves a random share of the boxes, or all of them, by up to half a unit along each
// axis. A share is a new random choice each frame, in random order; all boxes are in the order of
// their ids.
class RandomMotion {
 public:
  RandomMotion(std::vector<Box> boxes, double share)
      : boxes_(std::move(boxes)), order_(boxes_.size()), all_(share == 1) {
    for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
    moving_ = static_cast<std::size_t>(static_cast<double>(boxes_.size()) * share);
  }
  const std::vector<Box>& boxes() const { return boxes_; }
  // The generator, for other random choices in the same frame.
  std::mt19937& random() { return random_; }

  // Valid until the next call.
  Moves next() {
    Moves moves;
    for (std::size_t k = 0; k < moving_; ++k) {
      if (!all_) std::swap(order_[k], order_[k + random_() % (boxes_.size() - k)]);
      Box& b = boxes_[order_[k]];
      const Vec3 by = {step_(random_), step_(random_), step_(random_)};
      const auto add = [&](const Vec3& v) { return Vec3{v.x + by.x, v.y + by.y, v.z + by.z}; };
      b = {add(b.lower), add(b.upper)};
      moves.ids.push_back(order_[k]);
      moves.boxes.push_back(b);
    }
    if (all_) moves.all = &boxes_;
    return moves;
  }

 private:
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  bool all_;
  std::size_t moving_;
  std::mt19937 random_{1};
  std::uniform_real_distribution<float> step_{-0.5f, 0.5f};
};

}  // namespace throng::bench
