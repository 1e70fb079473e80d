#include "apps/scenes/scene.hpp"

#include <cstdio>
#include <stdexcept>

#include "apps/scenes/generator.hpp"

namespace throng::scenes {
namespace {

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

void check(const Spec& spec) {
  bool known = false;
  std::string list;
  for (const std::string& name : names()) {
    known = known || name == spec.name;
    list += (list.empty() ? "" : ", ") + name;
  }
  if (!known) {
    throw std::invalid_argument("no scene has the name '" + spec.name + "'; there are: " + list);
  }
  if (spec.objects > max_box_count) {
    throw std::invalid_argument(std::to_string(spec.objects) + " objects are too many; at most " +
                                std::to_string(max_box_count));
  }
  if (spec.frames < 1 || spec.frames > max_frames) {
    throw std::invalid_argument(std::to_string(spec.frames) + " frames; wanted 1 to " +
                                std::to_string(max_frames));
  }
  if (spec.density != 0 && !(spec.density >= min_density && spec.density <= max_density)) {
    throw std::invalid_argument("a density of " + text_of(spec.density) +
                                " pairs per box; wanted " + text_of(min_density) +
                                " to 1000000, or 0 for the scene's default");
  }
  if (!(spec.moving >= 0 && spec.moving <= 1)) {
    throw std::invalid_argument("a moving share of " + text_of(spec.moving) + "; wanted 0 to 1");
  }
}

}  // namespace

const std::vector<std::string>& names() {
  static const std::vector<std::string> all = {
      "uniform", "pile",   "column", "spheres",  "mixed",      "clusters", "rods",
      "line",    "sparse", "worlds", "rods-any", "rectangles", "nbody"};
  return all;
}

Scene::Scene(const Spec& spec) : spec_(spec) {
  check(spec);
  std::unique_ptr<Generator> made = make_scatter(spec_);
  if (!made) made = make_pile(spec_);
  if (!made) made = make_column(spec_);
  generator_ = std::move(made);
}

void Scene::boxes(std::size_t f, std::size_t begin, std::size_t end, Box* out) const {
  generator_->boxes(f, begin, end, out);
}

bool Scene::moves(std::size_t i) const noexcept { return generator_->moves(i); }
bool Scene::has_worlds() const noexcept { return generator_->has_worlds(); }
std::int32_t Scene::world(std::size_t i) const noexcept { return generator_->world(i); }
double Scene::side() const noexcept { return generator_->side(); }

}  // namespace throng::scenes
