// Any finite coordinates: the filter, expansions and integers give the same signs, and an
// exchange of two points the opposite.
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>

#include "fuzz/target.hpp"
#include "mesh/integer_orientation.hpp"
#include "mesh/orient.hpp"
#include "mesh/point_cases.hpp"

namespace throng::tests {
namespace {

// Small integers, scaled, offset or as they are; a coordinate before it, moved by some units in the
// last place; a sum of two before it; eight bytes as a double or four as a float.
double draw_coordinate(Bytes& bytes, const double* before, std::uint32_t count) {
  const auto small = [&] { return static_cast<double>(bytes.between(-4, 4)); };
  const auto earlier = [&] { return count == 0 ? 0.0 : before[bytes.below(count)]; };
  double x = 0;
  switch (bytes.below(8)) {
    case 0:
      x = small();
      break;
    case 1:
      x = std::ldexp(small(), bytes.between(-128, 127));
      break;
    case 2:
      x = std::ldexp(small(), -1074 + static_cast<int>(bytes.word() % 2096));
      break;
    case 3: {
      const double from = earlier();
      const int steps = bytes.between(-3, 3);
      const double infinity = std::numeric_limits<double>::infinity();
      x = from;
      for (int s = std::abs(steps); s > 0; --s)
        x = std::nextafter(x, steps < 0 ? -infinity : infinity);
      break;
    }
    case 4:
      x = earlier();
      x += earlier();
      break;
    case 5:
      x = small() * earlier();
      break;
    case 6: {
      const std::uint64_t low = bytes.word();
      x = std::bit_cast<double>(low | std::uint64_t{bytes.word()} << 32);
      break;
    }
    case 7:
      x = static_cast<double>(std::bit_cast<float>(bytes.word()));
      break;
  }
  return std::isfinite(x) ? x : 0;
}

void require(bool holds, const char* what, const FourPoints& points) {
  if (!holds) throw Difference(std::string(what) + ": " + to_text(points));
}

}  // namespace

void run(Bytes& bytes) {
  double coordinates[12];
  std::uint32_t count = 0;
  FourPoints p{};
  for (DoubleVec3& point : p)
    for (int axis = 0; axis < 3; ++axis) {
      coordinates[count] = draw_coordinate(bytes, coordinates, count);
      coordinate(point, axis) = coordinates[count++];
    }

  const int expected = integer_orient3d(p);
  const int filter = mesh::orient3d_filter(p[0], p[1], p[2], p[3]);
  require(filter == expected || filter == mesh::uncertain, "the filter is wrong", p);
  require(mesh::orient3d_exact_sign(p[0], p[1], p[2], p[3]) == expected, "expansions differ", p);
  require(mesh::orient3d_integer_sign(p[0], p[1], p[2], p[3]) == expected, "integers differ", p);
  const std::size_t i = bytes.below(4), k = (i + 1 + bytes.below(3)) % 4;
  FourPoints q = p;
  std::swap(q[i], q[k]);
  require(mesh::orient3d_sign(q[0], q[1], q[2], q[3]) == -expected, "an exchange keeps the sign",
          q);

  const auto flat = [](auto&& predicate, const FourPoints& points) {
    return predicate(points[0].x, points[0].y, points[1].x, points[1].y, points[2].x, points[2].y);
  };
  const int expected_flat = integer_orient2d(p[0], p[1], p[2]);
  const int flat_filter = flat(mesh::orient2d_filter, p);
  require(flat_filter == expected_flat || flat_filter == mesh::uncertain,
          "the filter in the plane is wrong", p);
  require(flat(mesh::orient2d_exact_sign, p) == expected_flat, "expansions in the plane differ", p);
  require(flat(mesh::orient2d_integer_sign, p) == expected_flat, "integers in the plane differ", p);
  std::swap(p[0], p[1]);
  require(flat(mesh::orient2d_sign, p) == -expected_flat, "an exchange keeps the sign", p);
}

}  // namespace throng::tests
