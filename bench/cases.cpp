#include "bench/cases.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <throng/checksum.hpp>

#include "apps/scenes/npy.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::bench {
namespace {

// Methods that keep their objects have nothing to do for boxes that do not move.
std::vector<Box> nudged(std::vector<Box> boxes) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    Box& b = boxes[i];
    const float reach =
        0.1f * std::max({b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z});
    if (!std::isfinite(reach)) continue;
    const std::uint64_t bits = mix64(i);
    for (int k = 0; k < 3; ++k) {
      const float by = reach * (static_cast<float>(bits >> (20 * k) & 0xfffff) / 524288.0f - 1.0f);
      (&b.lower.x)[k] += by;
      (&b.upper.x)[k] += by;
    }
  }
  return boxes;
}

}  // namespace

const std::vector<SceneChoice>& all_scenes() {
  static const std::vector<SceneChoice> scenes = {
      {"uniform", "uniform", 0}, {"uniform, density 2", "uniform", 2},
      {"pile", "pile", 0},       {"pile, density 9.7", "pile", 9.7},
      {"mixed", "mixed", 0},     {"clusters", "clusters", 0},
      {"rods", "rods", 0},       {"rods-any", "rods-any", 0},
      {"line", "line", 0},       {"spheres", "spheres", 0},
      {"sparse", "sparse", 0},   {"worlds", "worlds", 0},
      {"column", "column", 0},
  };
  return scenes;
}

SceneChoice find_scene(const std::string& text) {
  for (const SceneChoice& s : all_scenes())
    if (s.label == text) return s;
  if (text.size() > 4 && text.substr(text.size() - 4) == ".npy") return {text, "", 0};
  const auto& names = scenes::names();
  if (std::find(names.begin(), names.end(), text) != names.end()) return {text, text, 0};
  std::string known;
  for (const SceneChoice& s : all_scenes()) known += (known.empty() ? "" : "; ") + s.label;
  throw std::invalid_argument("no scene has the name '" + text + "'; there are: " + known +
                              "; or a path that ends in .npy");
}

Case make_case(const SceneChoice& choice, std::size_t objects, std::size_t most_frames) {
  Case c;
  c.scene = choice;
  if (choice.name.empty()) {
    const scenes::BoxFile file = scenes::read_boxes(choice.label);
    c.objects = objects == 0 ? file.count : std::min(objects, file.count);
    for (std::size_t f = 0; f < std::min(file.frames, most_frames); ++f)
      c.frames.emplace_back(file.frame(f), file.frame(f) + c.objects);
    if (c.frames.empty()) throw scenes::FileError(choice.label + ": no frame in it");
    if (c.frames.size() == 1) c.frames.push_back(nudged(c.frames[0]));
    return c;
  }
  scenes::Spec spec;
  spec.name = choice.name;
  spec.objects = objects;
  spec.density = choice.density;
  spec.frames = 100;
  const scenes::Scene scene(spec);
  c.objects = objects;
  c.frames.resize(most_frames);
  for (std::size_t f = 0; f < most_frames; ++f) {
    c.frames[f].resize(objects);
    // The column is dense at the end of its fall; in other scenes any frames will do.
    scene.frame(choice.name == "column" ? 99 - f : f, c.frames[f].data());
  }
  if (scene.has_worlds()) {
    c.worlds.resize(objects);
    for (std::size_t i = 0; i < objects; ++i) c.worlds[i] = scene.world(i);
  }
  return c;
}

}  // namespace throng::bench
