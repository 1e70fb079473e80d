// throng-orient-soak: signs of determinants of random points, compared with integers of 128 bits.
// Prints how many signs were compared. Stops at the first difference and prints its points.
//
// Coordinates are integers so small that the determinant has less than 127 bits. They are then
// scaled by a power of two per axis, which is exact and keeps the sign.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "mesh/orient.hpp"
#include "mesh/point_cases.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

__extension__ using Integer = __int128;

// Bits of the coordinates of the three axes: all differences are exact; those of two axes are not;
// one axis has more bits than two doubles. A difference has one bit more, a determinant the sum of
// its bits and log2(6).
constexpr int widths[][3] = {{38, 38, 38}, {57, 57, 3}, {100, 9, 9}};

int sign_of(Integer x) { return (x > 0) - (x < 0); }

struct Counts {
  std::uint64_t signs = 0, zeros = 0, uncertain = 0, inexact_differences = 0, wide = 0;
};

class OrientSoak {
 public:
  explicit OrientSoak(std::uint64_t seed) : random_(seed) {}

  // Draws points and compares their signs; false if one differs.
  bool round() {
    draw_width();
    for (int i = 0; i < 3; ++i)
      for (int axis = 0; axis < 3; ++axis) set(i, axis, draw_integer(axis));
    const std::uint32_t kind = random_.below(4);
    for (int axis = 0; axis < 3; ++axis) set(3, axis, fourth(kind, axis));
    const bool wide = random_.one_in(1024);
    for (int axis = 0; axis < 3; ++axis) {
      const int exponent = wide ? random_.between(-1074, 900) : random_.between(-250, 190);
      for (DoubleVec3& p : points_) coordinate(p, axis) = std::ldexp(coordinate(p, axis), exponent);
    }
    counts_.wide += wide;
    return compare_in_space() && compare_in_the_plane();
  }

  const Counts& counts() const { return counts_; }
  const FourPoints& points() const { return points_; }

 private:
  void draw_width() {
    const int* const width = widths[random_.below(3)];
    const int first = static_cast<int>(random_.below(3));
    const bool narrow = random_.one_in(3);  // many coincidences
    for (int axis = 0; axis < 3; ++axis) {
      bits_[axis] = width[(first + axis) % 3];
      if (narrow && bits_[axis] > 6) bits_[axis] = 1 + random_.between(0, 5);
      // Far from the origin, if the sum is a double.
      offset_[axis] = bits_[axis] <= 38 && random_.one_in(2)
                          ? static_cast<Integer>(random_.next() >> 14)  // below 2^50
                          : 0;
    }
  }

  // At most 53 bits, somewhere in the bits of the axis.
  Integer draw_integer(int axis) {
    const int bits = bits_[axis];
    const int used = bits < 53 ? bits : random_.between(1, 53);
    const int shift = static_cast<int>(random_.below(static_cast<std::uint32_t>(bits - used + 1)));
    const Integer magnitude = static_cast<Integer>(random_.next() >> (64 - used)) << shift;
    return random_.one_in(2) ? magnitude : -magnitude;
  }

  Integer fourth(std::uint32_t kind, int axis) {
    if (kind == 0) return draw_integer(axis);
    // In the plane of the others, or one off it. The factors are those of all axes.
    if (axis == 0) {
      s_ = random_.between(-2, 2);
      t_ = random_.between(-2, 2);
      nudged_axis_ = random_.below(8);
    }
    const Integer a = integers_[0][axis];
    Integer value = a + s_ * (integers_[1][axis] - a) + t_ * (integers_[2][axis] - a);
    if (kind == 1 && nudged_axis_ == static_cast<std::uint32_t>(axis))
      value += random_.one_in(2) ? 1 : -1;
    // Within the bits of the axis, so that the determinant stays within 127.
    const Integer most = Integer{1} << bits_[axis];
    return value < most && value > -most ? value : draw_integer(axis);
  }

  // The nearest double and its value.
  void set(int point, int axis, Integer value) {
    const double x = static_cast<double>(value + offset_[axis]);
    coordinate(points_[static_cast<std::size_t>(point)], axis) = x;
    integers_[point][axis] = static_cast<Integer>(x) - offset_[axis];
  }

  bool compare(int found, int expected) {
    ++counts_.signs;
    return found == expected;
  }

  bool compare_in_space() {
    Integer d[3][3];
    bool exact = true;
    for (int i = 0; i < 3; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        d[i][axis] = integers_[i + 1][axis] - integers_[0][axis];
        exact = exact && static_cast<Integer>(static_cast<double>(d[i][axis])) == d[i][axis];
      }
    const int expected = sign_of(d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) +
                                 d[0][1] * (d[1][2] * d[2][0] - d[1][0] * d[2][2]) +
                                 d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]));
    counts_.zeros += expected == 0;
    counts_.inexact_differences += !exact;
    const FourPoints& p = points_;
    const int filter = mesh::orient3d_filter(p[0], p[1], p[2], p[3]);
    counts_.uncertain += filter == mesh::uncertain;
    return (filter == mesh::uncertain || compare(filter, expected)) &&
           compare(mesh::orient3d_exact_sign(p[0], p[1], p[2], p[3]), expected);
  }

  bool compare_in_the_plane() {
    const int i = static_cast<int>(random_.below(3)), k = (i + 1) % 3;
    const Integer x1 = integers_[1][i] - integers_[0][i], y1 = integers_[1][k] - integers_[0][k];
    const Integer x2 = integers_[2][i] - integers_[0][i], y2 = integers_[2][k] - integers_[0][k];
    const int expected = sign_of(x1 * y2 - y1 * x2);
    const auto found = [&](auto&& predicate) {
      return predicate(coordinate(points_[0], i), coordinate(points_[0], k),
                       coordinate(points_[1], i), coordinate(points_[1], k),
                       coordinate(points_[2], i), coordinate(points_[2], k));
    };
    const int filter = found(mesh::orient2d_filter);
    return (filter == mesh::uncertain || compare(filter, expected)) &&
           compare(found(mesh::orient2d_exact_sign), expected);
  }

  Random random_;
  Counts counts_;
  FourPoints points_{};
  Integer integers_[4][3] = {}, offset_[3] = {};
  int bits_[3] = {};
  int s_ = 0, t_ = 0;
  std::uint32_t nudged_axis_ = 0;
};

constexpr std::uint64_t progress_signs = 100'000'000;

int run(std::uint64_t signs, std::uint64_t seed) {
  OrientSoak soak(seed);
  std::uint64_t rounds = 0;
  const auto number = [](std::uint64_t x) { return static_cast<unsigned long long>(x); };
  std::uint64_t next_report = progress_signs;
  for (; soak.counts().signs < signs; ++rounds) {
    if (soak.counts().signs >= next_report) {
      std::printf("%llu signs\n", number(soak.counts().signs));
      std::fflush(stdout);
      next_report += progress_signs;
    }
    if (!soak.round()) {
      std::printf("DIFFERENCE in round %llu, seed %llu: %s\n", number(rounds), number(seed),
                  to_text(soak.points()).c_str());
      return 1;
    }
  }
  const Counts& c = soak.counts();
  std::printf(
      "%llu signs of %llu sets of points: %llu coplanar, %llu uncertain to the filter, %llu with "
      "inexact differences, %llu beyond the range of expansions\nno difference\n",
      number(c.signs), number(rounds), number(c.zeros), number(c.uncertain),
      number(c.inexact_differences), number(c.wide));
  return c.zeros > 0 && c.uncertain > 0 && c.inexact_differences > 0 ? 0 : 1;
}

}  // namespace
}  // namespace throng::tests

int main(int argc, char** argv) {
  std::uint64_t signs = 1'000'000'000, seed = 1;
  for (int i = 1; i < argc; i += 2) {
    const bool is_last = i + 1 == argc;
    if (!is_last && std::strcmp(argv[i], "--signs") == 0)
      signs = std::strtoull(argv[i + 1], nullptr, 10);
    else if (!is_last && std::strcmp(argv[i], "--seed") == 0)
      seed = std::strtoull(argv[i + 1], nullptr, 10);
    else {
      std::printf("usage: throng-orient-soak [--signs 1000000000] [--seed 1]\n");
      return 2;
    }
  }
  return throng::tests::run(signs, seed);
}
