// One frame of a scene, with its boxes' worlds if it has them.
#pragma once

#include <vector>

#include <throng/boxes.hpp>

#include "apps/scenes/scene.hpp"

namespace throng::tests {

struct SceneBoxes {
  std::vector<Box> boxes;
  std::vector<std::int32_t> worlds;

  explicit SceneBoxes(const scenes::Spec& spec, std::size_t frame = 0) {
    const scenes::Scene made(spec);
    boxes.resize(made.size());
    made.frame(frame, boxes.data());
    for (std::size_t i = 0; i < boxes.size() && made.has_worlds(); ++i)
      worlds.push_back(made.world(i));
  }
  Boxes view() const {
    Boxes view = boxes;
    if (!worlds.empty()) view.filters.world = {worlds.data(), worlds.size()};
    return view;
  }
};

}  // namespace throng::tests
