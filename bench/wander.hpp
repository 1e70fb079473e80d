// What the benchmarks of objects that live share: boxes that wander, told frame by frame.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <throng/broad_phase.hpp>

#include "bench/moving.hpp"
#include "scene/scene.hpp"

namespace throng::bench {

template <class F>
double ms(F&& f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

extern const char* const program_name;  // each program's own

inline void must(const Result& r) {
  if (r.ok()) return;
  std::fprintf(stderr, "%s: %s\n", program_name, r.message);
  std::exit(1);
}

inline void start_with(BroadPhase& broad_phase, const std::vector<Box>& boxes) {
  must(broad_phase.add(boxes, nullptr));
  must(broad_phase.update());
}
inline void follow(BroadPhase& broad_phase, const Moves& moves) {
  if (moves.all)
    must(broad_phase.move_all(*moves.all));
  else
    must(broad_phase.move(moves.ids.data(), moves.boxes));
  must(broad_phase.update());
}

// The first frame of a scene.
inline std::vector<Box> boxes_of(const std::string& scene, std::size_t objects) {
  scene::Spec spec;
  spec.name = scene;
  spec.objects = objects;
  std::vector<Box> boxes(objects);
  scene::Scene(spec).frame(0, boxes.data());
  return boxes;
}

// Each frame a share of the boxes is drawn anew, in any order, or are all, in the order of their
// ids; each goes by up to half a unit along each axis.
class Wander {
 public:
  Wander(std::vector<Box> boxes, double share)
      : boxes_(std::move(boxes)), order_(boxes_.size()), all_(share == 1) {
    for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
    moving_ = static_cast<std::size_t>(static_cast<double>(boxes_.size()) * share);
  }
  const std::vector<Box>& boxes() const { return boxes_; }
  // Where the next numbers come from, for whoever asks something of the frame.
  std::mt19937& random() { return random_; }

  // Good until the next.
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
