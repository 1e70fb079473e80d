// A benchmark case: a scene or a file at a number of boxes, and several frames of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "bench/competitors/method.hpp"

namespace throng::bench {

struct SceneChoice {
  std::string label;   // "uniform", "uniform, density 2", or a file's path
  std::string name;    // of the scene; empty for a file
  double density = 0;  // 0: the scene's own
};

struct Case {
  SceneChoice scene;
  std::size_t objects = 0;
  std::vector<std::vector<Box>> frames;
  std::vector<std::int32_t> worlds;  // empty: none

  // Frames are played forwards, then backwards: from each frame to the next the boxes move as in a
  // simulation, on which methods that keep their objects depend.
  std::size_t index(std::size_t f) const {
    const std::size_t turn = frames.size() < 2 ? 1 : 2 * (frames.size() - 1), at = f % turn;
    return at < frames.size() ? at : turn - at;
  }
  Input input(std::size_t f) const {
    return {frames[index(f)].data(), objects, worlds.empty() ? nullptr : worlds.data()};
  }
};

const std::vector<SceneChoice>& all_scenes();
// By label, or a name of the scenes, or a path that ends in .npy. Throws std::invalid_argument.
SceneChoice find_scene(const std::string& text);

// Of a file, the first `objects` boxes of each frame; 0: all. Throws scenes::FileError and
// std::invalid_argument. At most `most_frames` frames; every box moves between frames. A file of
// one frame gets a second, in which each box is moved by up to a tenth of its largest extent.
Case make_case(const SceneChoice& scene, std::size_t objects, std::size_t most_frames);

}  // namespace throng::bench
