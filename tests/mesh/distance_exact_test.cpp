// Triangles within a distance, against exact rational distances.
#include "mesh/distance.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "mesh/rational_geometry.hpp"
#include "mesh/triangle_cases.hpp"

namespace throng::tests {
namespace {

// Distances to try: near the exact one, and others. All finite, >= 0.
std::vector<double> distances_near(const SquaredDistance& exact, Random& random) {
  // The root of the square, within a few units in the last place, also of tiny and huge ones.
  long exponent = 0;
  const double mantissa = exact.value == 0 ? 0 : [&] {
    long numerator, denominator;
    const double n = mpz_get_d_2exp(&numerator, exact.value.get_num_mpz_t());
    const double d = mpz_get_d_2exp(&denominator, exact.value.get_den_mpz_t());
    exponent = numerator - denominator;
    return n / d;
  }();
  const int odd = static_cast<int>(exponent % 2 != 0);
  const double root =
      std::ldexp(std::sqrt(std::ldexp(mantissa, odd)), static_cast<int>((exponent - odd) / 2));
  const double up = std::numeric_limits<double>::infinity();
  std::vector<double> result = {0, root, std::nextafter(root, up), std::nextafter(root, 0)};
  for (const double factor : {1e-15, 1e-13, 9e-13, 1.1e-12, 1e-11, 1e-6, 0.1})
    for (const double sign : {-1.0, 1.0}) result.push_back(root * (1 + sign * factor));
  result.push_back(std::ldexp(std::fabs(unit_double(random)), random.between(-1074, 1023)));
  result.push_back(std::numeric_limits<double>::max());
  result.push_back(std::numeric_limits<double>::denorm_min());
  for (double& d : result)
    if (!std::isfinite(d)) d = std::numeric_limits<double>::max();
  return result;
}

struct Counts {
  std::array<int, static_cast<std::size_t>(Closest::count)> closest{};
  int near = 0, far = 0, uncertain = 0;
};

void check(const TwoTriangles& t, const std::vector<double>& distances,
           const SquaredDistance& exact, Counts& counts) {
  const mpq_class factor = 1 + mpq_class(1, 1000000) * mpq_class(1, 1000000);
  for (const double distance : distances) {
    const mpq_class limit = mpq_class(distance) * mpq_class(distance);
    const bool is_within = exact.value <= limit;
    const bool may_be_within = exact.value <= limit * factor * factor;
    const auto where = [&] {
      char line[80];
      std::snprintf(line, sizeof line, "distance %a\n", distance);
      return line + to_text(t);
    };
    const int filtered = mesh::triangles_within_filter(t.a, t.b, distance);
    if (filtered != mesh::uncertain) {
      EXPECT_TRUE(filtered == 1 ? may_be_within : !is_within) << where();
    }
    const bool result = mesh::triangles_within(t.a, t.b, distance);
    EXPECT_TRUE(result ? may_be_within : !is_within) << where();
    if (filtered == mesh::uncertain || distance == distances[1]) {
      EXPECT_EQ(mesh::triangles_within_exact(t.a, t.b, distance), is_within) << where();
    }
    (filtered == 1 ? counts.near : filtered == 0 ? counts.far : counts.uncertain) += 1;
  }
}

TEST(TrianglesWithin, AgreesWithRationals) {
  Random random(1);
  Counts all;
  for (int k = 0; k < triangle_kind_count; ++k) {
    Counts counts;
    const auto kind = static_cast<TriangleKind>(k);
    for (int n = 0; n < 30; ++n) {
      const TwoTriangles t = draw_triangles(random, kind);
      const SquaredDistance exact = squared_distance(exact_triangle(t.a.p), exact_triangle(t.b.p));
      ++counts.closest[static_cast<std::size_t>(exact.between)];
      ++all.closest[static_cast<std::size_t>(exact.between)];
      check(t, distances_near(exact, random), exact, counts);
    }
    // Integers decide only where distances are tiny against the triangles, or for extreme scales.
    const bool is_ordinary =
        kind == TriangleKind::random || kind == TriangleKind::small_grid ||
        kind == TriangleKind::grid_plane || kind == TriangleKind::degenerate ||
        kind == TriangleKind::parallel_planes || kind == TriangleKind::parallel_edges ||
        kind == TriangleKind::far_from_origin || kind == TriangleKind::mixed_exponents;
    if (is_ordinary) {
      EXPECT_EQ(counts.uncertain, 0) << k;
      EXPECT_GT(counts.near, 0) << k;
      EXPECT_GT(counts.far, 0) << k;
    }
    if (kind == TriangleKind::scaled_random) {
      EXPECT_GT(counts.uncertain, 0);
    }
  }
  // Each kind of features was the closest often.
  for (const int n : all.closest) EXPECT_GE(n, 20);
}

}  // namespace
}  // namespace throng::tests
