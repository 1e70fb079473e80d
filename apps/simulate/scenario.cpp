#include "apps/simulate/scenario.hpp"

#include <algorithm>
#include <cmath>

#include "apps/scenes/random.hpp"

namespace throng::simulate {
namespace {

constexpr double identity_rotation[4] = {0, 0, 0, 1};
constexpr double slope = 1.5;  // of a pile

using scenes::Random;
using scenes::unit;

Placement at(double x, double y, double z, const double (&rotation)[4] = identity_rotation) {
  return {{x, y, z}, {rotation[0], rotation[1], rotation[2], rotation[3]}};
}
std::size_t whole(double x) { return static_cast<std::size_t>(std::max(1.0, std::ceil(x))); }
// In [-1, 1].
double spread(const Random& random, std::size_t i, unsigned k) {
  return 2 * unit(random.word(i, k)) - 1;
}

// A tenth of a gap between neighbours, and a random offset, or the column would stand for ever.
std::vector<Placement> column(const Extent& e, std::size_t objects, const Random& random) {
  const double side = std::cbrt(static_cast<double>(objects) * e.x * e.y * e.z / 4);
  const std::size_t nx = whole(side / e.x), ny = whole(side / e.y);
  std::vector<Placement> all;
  for (std::size_t i = 0; i < objects; ++i) {
    const auto line = [&](std::size_t k, double centre, double size, unsigned word) {
      return (static_cast<double>(k) - centre) * 1.1 * size + 0.02 * spread(random, i, word);
    };
    all.push_back(at(line(i % nx, static_cast<double>(nx - 1) / 2, e.x, 0),
                     line(i / nx % ny, static_cast<double>(ny - 1) / 2, e.y, 1),
                     line(i / (nx * ny), -2.5, e.z, 2)));
  }
  return all;
}

// A uniform random rotation (Shoemake).
struct Rotation {
  double q[4];
};
Rotation random_rotation(const Random& random, std::size_t i) {
  const double u = unit(random.word(i, 3)), tau = 6.283185307179586;
  const double v = tau * unit(random.word(i, 4)), w = tau * unit(random.word(i, 5));
  const double a = std::sqrt(1 - u), b = std::sqrt(u);
  return {{a * std::sin(v), a * std::cos(v), b * std::sin(w), b * std::cos(w)}};
}
// The smallest sphere that contains it in every orientation.
double bounding_diameter(Shape shape) {
  const Extent e = extent(shape);
  return shape == Shape::sphere ? e.x : std::sqrt(e.x * e.x + e.y * e.y + e.z * e.z);
}

// Round layers, each smaller than the one below: loose, and too steep to be stable.
std::vector<Placement> pile(double cell, std::size_t objects, const Random& random) {
  const double volume = static_cast<double>(objects) * cell * cell * cell;
  const double radius = std::cbrt(3 * volume / (3.14159265358979 * slope)) + cell;
  std::vector<Placement> all;
  for (std::size_t layer = 0; all.size() < objects; ++layer) {
    const double z = (static_cast<double>(layer) + 0.5) * cell;
    const double r = std::max(radius - z / slope, 0.0);  // at the top: single objects on each other
    const double shift = layer % 2 ? 0.5 : 0.0;
    const auto reach = static_cast<long>(r / cell);
    for (long y = -reach; y <= reach; ++y) {
      for (long x = -reach; x <= reach && all.size() < objects; ++x) {
        const double px = (static_cast<double>(x) + shift) * cell;
        const double py = (static_cast<double>(y) + shift) * cell;
        if (px * px + py * py > r * r && (x != 0 || y != 0)) continue;
        all.push_back(at(px, py, z, random_rotation(random, all.size()).q));
      }
    }
  }
  return all;
}

// One object at a random place in each cell.
std::vector<Placement> rain(double cell, std::size_t objects, const Random& random) {
  const std::size_t n = whole(std::cbrt(static_cast<double>(objects)));
  const double centre = static_cast<double>(n - 1) / 2;
  std::vector<Placement> all;
  for (std::size_t i = 0; i < objects; ++i) {
    const auto line = [&](std::size_t k, double from, unsigned word) {
      return (static_cast<double>(k) - from + 0.24 * spread(random, i, word)) * cell;
    };
    all.push_back(at(line(i % n, centre, 0), line(i / n % n, centre, 1), line(i / (n * n), -1, 2),
                     random_rotation(random, i).q));
  }
  return all;
}

}  // namespace

const std::vector<std::string>& shape_names() {
  static const std::vector<std::string> names = {"cube", "sphere", "rectangle"};
  return names;
}
const std::vector<std::string>& scene_names() {
  static const std::vector<std::string> names = {"column", "pile", "rain"};
  return names;
}
const char* to_string(Shape shape) {
  return shape_names()[static_cast<std::size_t>(shape)].c_str();
}
const char* to_string(Scene scene) {
  return scene_names()[static_cast<std::size_t>(scene)].c_str();
}

Extent extent(Shape shape) {
  return shape == Shape::rectangle ? Extent{2, 1, 0.5} : Extent{1, 1, 1};
}

std::vector<Placement> place(Scene scene, Shape shape, std::size_t objects, std::uint64_t seed) {
  const Random random(seed, 100 + static_cast<std::uint64_t>(scene));
  switch (scene) {
    case Scene::column:
      return column(extent(shape), objects, random);
    case Scene::pile:
      return pile(1.02 * bounding_diameter(shape), objects, random);
    default:
      return rain(2 * bounding_diameter(shape), objects, random);
  }
}

}  // namespace throng::simulate
