// Four points that are hard for predicates: drawn by kind, in the plane of the first three or close
// to it in most kinds.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>

#include <throng/types.hpp>

#include "support/random.hpp"

namespace throng::tests {

using FourPoints = std::array<DoubleVec3, 4>;

// The axis of a coordinate by number.
inline double& coordinate(DoubleVec3& p, int axis) {
  return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}
inline double coordinate(const DoubleVec3& p, int axis) {
  return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

// A double in (-1, 1) with 53 random bits.
inline double unit_double(Random& random) {
  return std::ldexp(static_cast<double>(static_cast<std::int64_t>(random.next()) >> 10), -53);
}
// Any finite double, each exponent as likely as another.
inline double any_double(Random& random) {
  for (;;) {
    const double x = std::bit_cast<double>(random.next());
    if (std::isfinite(x)) return x;
  }
}
// A few doubles up or down.
inline double nudged(double x, Random& random) {
  const double target = random.one_in(2) ? std::numeric_limits<double>::infinity()
                                         : -std::numeric_limits<double>::infinity();
  for (std::uint32_t n = random.below(3); n > 0; --n) x = std::nextafter(x, target);
  return std::isfinite(x) ? x : 0;
}

enum class PointKind {
  random,               // in a cube
  small_grid,           // integers -2 .. 2
  grid_plane,           // integer combinations of two integer vectors: exactly coplanar
  rounded_plane,        // combinations of two vectors, rounded to doubles
  float_rounded_plane,  // rounded to floats
  nudged_plane,         // exactly coplanar, then moved by a few units in the last place
  repeated,             // points that are equal or nearly so
  sliver,               // close to a line
  far_from_origin,      // small offsets from 1e7
  mixed_exponents,      // exponents -30 .. 30
  wide_exponents,       // all exponents of the expansions' range
  huge,                 // near the largest doubles
  denormal,             // multiples of the least double
  near_underflow,       // products near the least double
  any,                  // any finite doubles
  float_any,            // any finite floats, denormals included
  extremes,             // 0, the least and the greatest doubles, 1
  count
};
constexpr int point_kind_count = static_cast<int>(PointKind::count);

inline FourPoints draw_points(Random& random, PointKind kind) {
  FourPoints points{};
  const auto fill = [&](auto&& draw) {
    for (DoubleVec3& p : points)
      for (int axis = 0; axis < 3; ++axis) coordinate(p, axis) = draw();
  };
  // Origin and two vectors drawn by `draw`, combined by factors drawn by `factor`.
  const auto fill_plane = [&](auto&& draw, auto&& factor, auto&& round) {
    DoubleVec3 basis[3];
    for (DoubleVec3& v : basis)
      for (int axis = 0; axis < 3; ++axis) coordinate(v, axis) = draw();
    for (DoubleVec3& p : points) {
      const double s = factor(), t = factor();
      for (int axis = 0; axis < 3; ++axis)
        coordinate(p, axis) = round(coordinate(basis[0], axis) + s * coordinate(basis[1], axis) +
                                    t * coordinate(basis[2], axis));
    }
  };
  const auto small = [&](int most) { return static_cast<double>(random.between(-most, most)); };
  const auto unit = [&] { return unit_double(random); };
  const auto unchanged = [](double x) { return x; };
  const auto integer_plane = [&] {
    fill_plane([&] { return small(100000); }, [&] { return small(30); }, unchanged);
  };
  switch (kind) {
    case PointKind::random:
      fill(unit);
      break;
    case PointKind::small_grid:
      fill([&] { return small(2); });
      break;
    case PointKind::grid_plane:
      integer_plane();
      break;
    case PointKind::rounded_plane:
      fill_plane(unit, unit, unchanged);
      break;
    case PointKind::float_rounded_plane:
      // A call, as GCC 12 drops this conversion from vectorized code.
      fill_plane(unit, unit, [](double x) {
        const volatile float rounded = static_cast<float>(x);
        return static_cast<double>(rounded);
      });
      break;
    case PointKind::nudged_plane:
      integer_plane();
      for (DoubleVec3& p : points)
        for (int axis = 0; axis < 3; ++axis)
          coordinate(p, axis) = nudged(coordinate(p, axis) * 0x1p-10, random);
      break;
    case PointKind::repeated: {
      fill(unit);
      for (std::uint32_t n = 1 + random.below(3); n > 0; --n)
        points[random.below(4)] = points[random.below(4)];
      if (random.one_in(2)) break;
      DoubleVec3& p = points[random.below(4)];
      p = {nudged(p.x, random), nudged(p.y, random), nudged(p.z, random)};
      break;
    }
    case PointKind::sliver: {
      const DoubleVec3 direction = {unit(), unit(), unit()};
      for (DoubleVec3& p : points) {
        const double s = unit();
        p = {nudged(s * direction.x, random), nudged(s * direction.y, random),
             nudged(s * direction.z, random)};
      }
      break;
    }
    case PointKind::far_from_origin:
      fill([&] { return 1e7 + small(3) * 0x1p-20 + (random.one_in(3) ? unit() * 0x1p-30 : 0); });
      break;
    case PointKind::mixed_exponents:
      fill([&] { return std::ldexp(unit(), random.between(-30, 30)); });
      break;
    case PointKind::wide_exponents:
      fill([&] { return std::ldexp(small(2) + unit(), random.between(-298, 298)); });
      break;
    case PointKind::huge: {
      const int exponent = random.between(900, 1022);
      integer_plane();
      for (DoubleVec3& p : points)
        for (int axis = 0; axis < 3; ++axis)
          coordinate(p, axis) = nudged(std::ldexp(coordinate(p, axis), exponent - 23), random);
      break;
    }
    case PointKind::denormal:
      fill([&] { return small(100) * std::numeric_limits<double>::denorm_min(); });
      break;
    case PointKind::near_underflow: {
      // Products of two or of three coordinates near 2^-1074, and one axis that may be large.
      const int base = random.one_in(2) ? -537 : -358;
      const int large = random.one_in(2) ? random.between(0, 1000) : base;
      for (DoubleVec3& p : points) {
        p.x = std::ldexp(unit(), base + random.between(-2, 2));
        p.y = std::ldexp(unit(), base + random.between(-2, 2));
        p.z = std::ldexp(unit(), large + random.between(-2, 2));
      }
      if (random.one_in(2)) points[0] = {0, 0, 0};
      break;
    }
    case PointKind::any:
      fill([&] { return any_double(random); });
      break;
    case PointKind::float_any:
      fill([&] {
        for (;;) {
          const float x = std::bit_cast<float>(static_cast<std::uint32_t>(random.next() >> 32));
          if (std::isfinite(x)) return static_cast<double>(x);
        }
      });
      break;
    case PointKind::extremes:
    case PointKind::count:
      fill([&] {
        using Limits = std::numeric_limits<double>;
        const double values[] = {0, Limits::denorm_min(), Limits::min(), 1, Limits::max()};
        return (random.one_in(2) ? 1 : -1) * values[random.below(5)];
      });
      break;
  }
  return points;
}

// The coordinates as they are written in a test.
inline std::string to_text(const FourPoints& points) {
  std::string text;
  for (const DoubleVec3& p : points) {
    char line[120];
    std::snprintf(line, sizeof line, "{%a, %a, %a}, ", p.x, p.y, p.z);
    text += line;
  }
  return text;
}

}  // namespace throng::tests
