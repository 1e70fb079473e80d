// The initial positions of a simulation: the scenes of the paper, and rain.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace throng::simulate {

enum class Shape { cube, sphere, rectangle };
enum class Scene {
  column,  // a column of objects, four times as high as wide, falls on a plane
  pile,    // a steep cone of loosely stacked objects collapses
  rain,    // objects far apart in random orientations fall from many heights
};

const std::vector<std::string>& shape_names();
const std::vector<std::string>& scene_names();
const char* to_string(Shape shape);
const char* to_string(Scene scene);

// A cube of side 1, a sphere of diameter 1, a rectangle (the paper's word for a box) of 2 x 1 x
// 0.5.
struct Extent {
  double x, y, z;
};
Extent extent(Shape shape);

struct Placement {
  double at[3];
  double turn[4];  // a unit quaternion: x, y, z, w
};

// z points up, the plane is z = 0, all objects are above it. Depends on its arguments alone.
std::vector<Placement> place(Scene scene, Shape shape, std::size_t objects, std::uint64_t seed);

}  // namespace throng::simulate
