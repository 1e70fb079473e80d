// Geometry that breaks broad phases which pass on random boxes. Each function returns about `n`
// boxes for a seed; hard_scenes() lists them all.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "support/lattices.hpp"
#include "support/random.hpp"

namespace throng::tests {

using BoxList = std::vector<Box>;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float denormal = std::numeric_limits<float>::denorm_min();
constexpr float float_max = std::numeric_limits<float>::max();

inline Box cube(Vec3 p, float side) { return {p, {p.x + side, p.y + side, p.z + side}}; }
inline Box cube(float x, float y, float z, float side) { return cube(Vec3{x, y, z}, side); }

inline BoxList uniform_boxes(int n, std::uint64_t seed) {
  Random r(seed);
  const float side = side_of(static_cast<float>(n) * 2);
  BoxList boxes;
  for (int i = 0; i < n; ++i) boxes.push_back(cube(r.point(0, side), 1));
  return boxes;
}

inline BoxList identical_boxes(int n, std::uint64_t seed) {
  Random r(seed);
  const Vec3 at = r.point(-9, 9);
  return BoxList(static_cast<std::size_t>(n), cube(at, r.unit()));
}

// One to three boxes over everything, at random positions in the array.
inline BoxList huge_among_small(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes = uniform_boxes(n, seed);
  for (int k = r.between(1, 3); k > 0; --k)
    boxes[r.below(static_cast<std::uint32_t>(n))] = {{-1e6f, -1e6f, -1e6f}, {1e6f, 1e6f, 1e6f}};
  return boxes;
}

// Half of the boxes cover half of the world or more: copies into cells would explode.
inline BoxList many_huge(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    const Vec3 at = r.point(0, i % 2 ? 50 : 100);
    boxes.push_back(cube(at, i % 2 ? r.in(50, 100) : 0.5f));
  }
  shuffle(boxes, r);
  return boxes;
}

// Touching boxes in a row along one axis (3: along the diagonal).
inline BoxList line_of_boxes(int n, int axis, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  const float pitch = r.magnitude(-2, 2), start = r.in(-50, 50);
  for (int i = 0; i < n; ++i) {
    float lower[3] = {0, 0, 0}, upper[3] = {1, 1, 1};
    for (int k = 0; k < 3; ++k)
      if (axis == k || axis == 3) {
        lower[k] = start + static_cast<float>(i) * pitch;
        upper[k] = start + static_cast<float>(i + 1) * pitch;
      }
    boxes.push_back({{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}});
  }
  shuffle(boxes, r);
  return boxes;
}

// A box and the 26 that meet it at a face, an edge or a corner: exactly, short of it by one ulp, or
// beyond it by one. The groups are separate.
inline BoxList faces_edges_corners(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  while (static_cast<int>(boxes.size()) + 27 <= n) {
    const float at[3] = {r.in(-1000, 1000), r.in(-1000, 1000), r.in(-1000, 1000)};
    const float edge[4] = {-1.25f, 0.5f, 1.75f, 3.0f};
    const int gap = r.between(-1, 1);
    for (int cell = 0; cell < 27; ++cell) {
      float lower[3], upper[3];
      for (int axis = 0, c = cell; axis < 3; ++axis, c /= 3) {
        lower[axis] = at[axis] + edge[c % 3];
        upper[axis] = at[axis] + edge[c % 3 + 1];
        if (c % 3 == 2) lower[axis] = nudge(lower[axis], gap);
        if (c % 3 == 0) upper[axis] = nudge(upper[axis], -gap);
      }
      boxes.push_back({{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}});
    }
  }
  shuffle(boxes, r);
  return boxes;
}

// At 1e7 adjacent floats differ by 1.
inline BoxList far_from_origin(int n, std::uint64_t seed) {
  Random r(seed);
  const int side = 3 + static_cast<int>(side_of(static_cast<float>(n) * 4));
  BoxList boxes;
  const auto at = [&] { return 1e7f + static_cast<float>(r.between(0, side)); };
  for (int i = 0; i < n; ++i) {
    const float x = at(), y = -at(), z = at();
    boxes.push_back({{x, y, z}, {x + static_cast<float>(r.between(0, 2)), y + 1, z + 1}});
  }
  return boxes;
}

// Coordinates below the smallest normal number, and a few boxes of ordinary size around them.
inline BoxList denormal_boxes(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  const auto at = [&] { return static_cast<float>(r.between(-200, 200)) * denormal; };
  for (int i = 0; i < n; ++i) {
    if (i % 97 == 0) {
      boxes.push_back(cube(r.point(-1, 0), 1));
      continue;
    }
    const float x = at(), y = at(), z = at();
    const auto size = [&] { return static_cast<float>(r.between(0, 60)) * denormal; };
    boxes.push_back({{x, y, z}, {x + size(), y + size(), z + size()}});
  }
  return boxes;
}

inline BoxList signed_zeros(int n, std::uint64_t seed) {
  Random r(seed);
  const float values[] = {-1.0f, -denormal, -0.0f, 0.0f, denormal, 1.0f};
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    float c[6];
    for (int k = 0; k < 3; ++k) {
      const int low = r.between(0, 5);
      c[k] = values[low];
      c[k + 3] = values[r.between(low == 3 ? 2 : low, 5)];  // 0 .. -0 is a point too
    }
    boxes.push_back({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}});
  }
  return boxes;
}

// Planes, half spaces, slabs, all space, and points at infinity among ordinary boxes.
inline BoxList infinite_bounds(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes = uniform_boxes(n, seed);
  for (Box& box : boxes) {
    if (!r.one_in(12)) continue;
    float* lower = &box.lower.x;
    float* upper = &box.upper.x;
    switch (r.below(5)) {
      case 0: {  // a plane across one axis
        const std::uint32_t across = r.below(3);
        for (std::uint32_t k = 0; k < 3; ++k)
          if (k != across) lower[k] = -infinity, upper[k] = infinity;
        upper[across] = lower[across];
        break;
      }
      case 1:
        lower[r.below(3)] = -infinity;
        break;
      case 2:
        upper[r.below(3)] = infinity;
        break;
      case 3:
        for (int k = 0; k < 3; ++k)
          if (r.one_in(2)) lower[k] = -infinity, upper[k] = infinity;
        break;
      default: {
        const std::uint32_t k = r.below(3);
        lower[k] = upper[k] = r.one_in(2) ? infinity : -infinity;
        break;
      }
    }
  }
  return boxes;
}

// Sums and differences of these overflow.
inline BoxList near_overflow(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  const auto at = [&] {
    return std::ldexp(static_cast<float>(r.between(-15, 15)), 124) + (r.one_in(3) ? 1e38f : 0.0f);
  };
  for (int i = 0; i < n; ++i) {
    const float x = at(), y = at(), z = at();
    const float size = r.one_in(5) ? 0.0f : std::ldexp(1.0f, r.between(100, 124));
    boxes.push_back({{x, y, z}, {x + size, y + size, z + size}});  // some reach infinity
  }
  boxes[0] = {{-float_max, -float_max, -float_max}, {float_max, float_max, float_max}};
  return boxes;
}

// Empty slots among the rest, inverted by a little, by much, and by infinity.
inline BoxList with_inverted(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes = uniform_boxes(n, seed);
  for (Box& box : boxes) {
    if (!r.one_in(6)) continue;
    const std::uint32_t k = r.below(3);
    float* lower = &box.lower.x + k;
    float* upper = &box.upper.x + k;
    switch (r.below(3)) {
      case 0:
        *lower = nudge(*upper, 1);
        break;
      case 1:
        std::swap(*lower, *upper);
        break;
      default:
        *lower = infinity, *upper = -infinity;
        break;
    }
  }
  return boxes;
}

// Points at few places: pairs by equality alone.
inline BoxList points(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  const int side = 2 + static_cast<int>(side_of(static_cast<float>(n)));
  for (int i = 0; i < n; ++i) {
    const Vec3 p = {static_cast<float>(r.between(0, side)),
                    static_cast<float>(r.between(0, side)) * 0.1f,
                    static_cast<float>(r.between(0, side)) - 7};
    boxes.push_back({p, p});
  }
  return boxes;
}

// Coordinates of only `levels` values: many quantization ties, and upper ends on the edges of any
// regular grid.
inline BoxList snapped_boxes(int n, int levels, float unit, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    float c[6];
    for (int k = 0; k < 3; ++k) {
      const int low = r.between(0, levels - 1);
      c[k] = static_cast<float>(low) * unit;
      c[k + 3] = static_cast<float>(low + r.between(0, 2)) * unit;
    }
    boxes.push_back({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}});
  }
  return boxes;
}

inline BoxList sizes_to_10000(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    const auto at = [&] { return r.in(-100, 100); };
    const auto size = [&] { return std::ldexp(r.in(1, 2), -r.between(0, 13)) * 20; };
    const float x = at(), y = at(), z = at();
    boxes.push_back({{x, y, z}, {x + size(), y + size(), z + size()}});
  }
  return boxes;
}

inline BoxList rods(int n, std::uint64_t seed) {
  Random r(seed);
  const float side = side_of(static_cast<float>(n) * 16);
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    Box box = cube(r.point(0, side), 0.25f);
    (&box.upper.x)[r.below(3)] += side * r.unit();
    boxes.push_back(box);
  }
  return boxes;
}

// Flat sheets, many in the same plane.
inline BoxList sheets(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    const Vec3 at = r.point(0, 30);
    Box box = cube(at, r.in(1, 4));
    const std::uint32_t k = r.below(3);
    (&box.lower.x)[k] = (&box.upper.x)[k] = static_cast<float>(r.between(0, 30));
    boxes.push_back(box);
  }
  return boxes;
}

// All but two boxes in one spot; those two stretch the bounds.
inline BoxList one_cell(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  const float side = side_of(static_cast<float>(n)) * 1e-3f;
  for (int i = 0; i < n; ++i) boxes.push_back(cube(r.point(5, 5 + side), 1e-3f));
  boxes[0] = cube(-1e6f, -1e6f, -1e6f, 1);
  boxes[1] = cube(1e6f, 1e6f, 1e6f, 1);
  return boxes;
}

inline BoxList clusters_and_outliers(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  while (static_cast<int>(boxes.size()) < n) {
    const Vec3 center = r.point(-1e5f, 1e5f);
    for (int k = 0; k < 40; ++k) {
      const Vec3 off = r.point(0, 4);
      boxes.push_back(cube(center.x + off.x, center.y + off.y, center.z + off.z, 1));
    }
  }
  boxes.resize(static_cast<std::size_t>(n));
  boxes[r.below(static_cast<std::uint32_t>(n))] = cube(1e30f, -1e30f, 1e30f, 1e28f);
  boxes[r.below(static_cast<std::uint32_t>(n))] = cube(-1e30f, 0, 3, 1);
  return boxes;
}

inline BoxList nested_boxes(int n, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    const float h = static_cast<float>(i + 1) * 0.125f;
    boxes.push_back({{3 - h, 4 - h, 5 - h}, {3 + h, 4 + h, 5 + h}});
  }
  shuffle(boxes, r);
  return boxes;
}

// Coordinates over very many powers of two on both sides of a centre, independent per axis. Some
// boxes touch, miss by one float, or extend from one zero to the other; some are unbounded.
inline BoxList many_decades(int n, float centre, std::uint64_t seed) {
  Random r(seed);
  BoxList boxes;
  for (int i = 0; i < n; ++i) {
    float c[6];
    for (int k = 0; k < 3; ++k) {
      const float at = r.magnitude(-60, 60) * (r.one_in(2) ? -1.0f : 1.0f);
      const float size = std::fabs(at) * std::ldexp(1.0f, -r.between(0, 9));
      c[k] = centre + at;
      c[k + 3] = c[k] + size;
      if (r.one_in(30)) c[k] = 0.0f, c[k + 3] = centre + size;
      if (r.one_in(30)) c[k] = centre - size, c[k + 3] = -0.0f;
      if (r.one_in(60)) (r.one_in(2) ? c[k] : c[k + 3]) *= infinity;
      if (!(c[k] <= c[k + 3])) c[k + 3] = c[k];
      if (!(c[k] <= c[k + 3])) c[k] = c[k + 3] = centre;
    }
    Box box = {{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
    if (r.one_in(3) && !boxes.empty()) {  // a neighbour of the previous box
      const std::uint32_t k = r.below(3);
      box = boxes.back();
      (&box.lower.x)[k] = nudge((&box.upper.x)[k], r.between(-1, 1));
      (&box.upper.x)[k] = std::max((&box.lower.x)[k], centre + std::fabs(c[k]));
    }
    boxes.push_back(box);
  }
  shuffle(boxes, r);
  return boxes;
}

// The same boxes, all coordinates multiplied.
inline BoxList scaled(BoxList boxes, float factor) {
  for (Box& box : boxes)
    for (int k = 0; k < 6; ++k) (&box.lower.x)[k] *= factor;
  return boxes;
}

struct HardScene {
  std::string name;
  BoxList boxes;
};

// `n`: about 600 for a short test, 3000 for a longer one.
inline std::vector<HardScene> hard_scenes(int n) {
  std::vector<HardScene> scenes = {
      {"uniform", uniform_boxes(n, 1)},
      {"identical", identical_boxes(n / 4, 2)},
      {"huge_among_small", huge_among_small(n, 3)},
      {"many_huge", many_huge(n / 3, 4)},
      {"line_x", line_of_boxes(n, 0, 5)},
      {"line_y", line_of_boxes(n, 1, 6)},
      {"line_z", line_of_boxes(n, 2, 7)},
      {"line_diagonal", line_of_boxes(n, 3, 8)},
      {"faces_edges_corners", faces_edges_corners(n, 9)},
      {"far_from_origin", far_from_origin(n, 10)},
      {"denormals", denormal_boxes(n, 11)},
      {"signed_zeros", signed_zeros(n / 3, 12)},
      {"infinite", infinite_bounds(n, 13)},
      {"near_overflow", near_overflow(n, 14)},
      {"inverted", with_inverted(n, 15)},
      {"points", points(n, 16)},
      {"snapped_4", snapped_boxes(n / 3, 4, 1.0f, 17)},
      {"snapped_16", snapped_boxes(n, 16, 0.1f, 18)},
      {"snapped_64", snapped_boxes(n, 64, 0x1p-6f, 19)},
      {"sizes_10000", sizes_to_10000(n, 20)},
      {"rods", rods(n, 21)},
      {"sheets", sheets(n, 22)},
      {"one_cell", one_cell(n, 23)},
      {"clusters", clusters_and_outliers(n, 24)},
      {"nested", nested_boxes(n / 4, 25)},
      {"decades", many_decades(n, 0, 26)},
      {"decades_around_5", many_decades(n, 5, 27)},
      {"tiny", scaled(faces_edges_corners(n, 28), 1e-36f)},
      {"tiniest", scaled(uniform_boxes(n, 29), 1e-42f)},
      {"vast", scaled(faces_edges_corners(n, 30), 3e35f)},
  };
  Lattice unit;  // integer-grid touching unit cubes
  unit.count[0] = unit.count[1] = 8;
  unit.count[2] = n / 64;
  scenes.push_back({"integer_grid", make_lattice(unit)});
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Lattice lattice = random_lattice(seed, n);
    scenes.push_back(
        {"lattice_" + std::to_string(seed) + " " + lattice.describe(), make_lattice(lattice)});
  }
  return scenes;
}

}  // namespace throng::tests
