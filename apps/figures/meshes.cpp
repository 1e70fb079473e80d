#include "apps/figures/meshes.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <vector>

#include <throng/find_pairs.hpp>
#include <throng/mesh.hpp>

#include "apps/figures/drawing.hpp"

namespace throng::figures {
namespace {

// The side of the plane x = y on which p lies, computed from the tetrahedron of p and three points
// of the plane, in doubles.
int rounded_side(const DoubleVec3& p) {
  const DoubleVec3 q = {12, 12, 0}, r = {24, 24, 0}, s = {0, 0, 1};
  const double x1 = q.x - p.x, y1 = q.y - p.y, z1 = q.z - p.z;
  const double x2 = r.x - p.x, y2 = r.y - p.y, z2 = r.z - p.z;
  const double x3 = s.x - p.x, y3 = s.y - p.y, z3 = s.z - p.z;
  const double determinant =
      z1 * (x2 * y3 - x3 * y2) + z2 * (x3 * y1 - x1 * y3) + z3 * (x1 * y2 - x2 * y1);
  return (determinant > 0) - (determinant < 0);
}

// The sides of all points, exact: a segment from p to a point on one side meets the plane if p is
// in the plane or on its other side.
std::vector<int> exact_sides(const std::vector<DoubleVec3>& points) {
  std::vector<DoubleVec3> vertices = points;
  vertices.push_back({2, -1, 0});
  vertices.push_back({-1, 2, 0});
  const auto n = static_cast<std::uint32_t>(points.size());
  std::vector<Triangle> segments;
  for (std::uint32_t i = 0; i < n; ++i) {
    segments.push_back({i, n, n});
    segments.push_back({i, n + 1, n + 1});
  }
  const std::vector<DoubleVec3> plane = {{-30, -30, -30}, {30, 30, -30}, {0, 0, 60}};
  const std::vector<Triangle> one = {{0, 1, 2}};
  std::vector<int> meets(2 * points.size()), sides;
  for (const Pair& pair : find_intersections({vertices, segments}, {plane, one}))
    meets[pair.first] = 1;
  for (std::size_t i = 0; i < points.size(); ++i) sides.push_back(meets[2 * i] - meets[2 * i + 1]);
  return sides;
}

struct Point {
  double x, y;
};

// Two triangles in one plane: `vertices`, and three indices each.
struct Case {
  const char* words;
  std::vector<Point> vertices;
  Triangle a, b;
};

std::string rule(const std::vector<Case>& cases) {
  constexpr int width = 190, height = 150;
  Drawing d(width * static_cast<int>(cases.size()), height);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& c = cases[i];
    const double left = width * static_cast<double>(i);
    std::vector<Vec3> vertices;
    std::vector<Drawing::Point> drawn;
    for (const Point& p : c.vertices) {
      vertices.push_back({static_cast<float>(p.x), static_cast<float>(p.y), 0});
      drawn.push_back({left + 15 + p.x, 10 + p.y});
    }
    const std::vector<Triangle> triangles = {c.a, c.b};
    const bool pair = !find_self_intersections({vertices, triangles}).empty();
    const auto corners = [&](const Triangle& t) {
      return std::vector<Drawing::Point>{drawn[t.a], drawn[t.b], drawn[t.c]};
    };
    d.polygon(corners(c.a), blue, 0.3);
    d.polygon(corners(c.b), orange, 0.3);
    const std::set<std::uint32_t> of_a = {c.a.a, c.a.b, c.a.c};
    for (const std::uint32_t v : {c.b.a, c.b.b, c.b.c}) {
      if (of_a.count(v)) d.dot(drawn[v].x, drawn[v].y, "#222222");
    }
    d.words(left + width / 2.0, 124, c.words, "middle");
    d.words(left + width / 2.0, 143, pair ? "a pair" : "no pair", "middle", pair ? red : grey);
  }
  return d.svg();
}

// A sheet of 2 n^2 triangles, pleated along both axes so that its folds cross.
struct Sheet {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
};
Sheet pleated_sheet(std::uint32_t n) {
  const auto wave = [](std::uint32_t i) {  // 0 .. 8, back and forth
    const std::uint32_t k = i % 16;
    return static_cast<float>(k < 8 ? k : 16 - k);
  };
  Sheet sheet;
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t j = 0; j <= n; ++j) {
      const auto x = static_cast<float>(i), y = static_cast<float>(j);
      sheet.vertices.push_back(
          {x + 0.8f * wave(3 * j), y + 0.7f * wave(5 * i), 0.3f * wave(i + 2 * j)});
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
      sheet.triangles.push_back({a, b, b + 1});
      sheet.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return sheet;
}

// 12345 as "12,345".
std::string grouped(std::uint64_t number) {
  if (number < 1000) return std::to_string(number);
  return fmt::format("{},{:03}", grouped(number / 1000), number % 1000);
}

}  // namespace

std::string mesh_side() {
  constexpr int n = 40, size = 8, top = 50;
  std::vector<DoubleVec3> points;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) points.push_back({0.5 + i * 0x1p-53, 0.5 + j * 0x1p-53, 0});
  const std::vector<int> exact = exact_sides(points);
  int wrong = 0;
  Drawing d(860, top + n * size + 40);
  const auto panel = [&](double left, bool rounded) {
    const auto colour_at = [&](int i, int j) {
      const auto at =
          static_cast<std::size_t>(j) * static_cast<std::size_t>(n) + static_cast<std::size_t>(i);
      const int side = rounded ? rounded_side(points[at]) : exact[at];
      if (side != exact[at]) return red;
      return side > 0 ? blue : (side < 0 ? green : orange);
    };
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n;) {
        const char* const colour = colour_at(i, j);
        const int begin = i;
        while (i < n && colour_at(i, j) == colour) ++i;
        if (colour == red) wrong += i - begin;
        // y goes up.
        d.cell(left + begin * size, top + (n - 1 - j) * size, (i - begin) * size, size, colour);
      }
    }
  };
  d.words(20, 32, "rounded doubles");
  panel(20, true);
  d.words(360, 32, "exact");
  panel(360, false);
  const auto legend = [&](double y, const char* colour, const std::string& words) {
    d.rectangle(700, y, 16, 14, colour, 1);
    d.words(724, y + 13, words);
  };
  legend(60, blue, "above the plane");
  legend(88, green, "below it");
  legend(116, orange, "in it");
  legend(144, red, fmt::format("wrong: {}", grouped(static_cast<std::uint64_t>(wrong))));
  d.words(724, 179, fmt::format("of {} points", grouped(static_cast<std::uint64_t>(n) * n)));
  d.words(20, top + n * size + 26,
          "neighbors are 2^-53 apart; the point at the lower left is (0.5, 0.5, 0); the plane is x "
          "= y");
  return d.svg();
}

std::string mesh_share_none() {
  return rule({{"apart",
                {{0, 0}, {70, 20}, {10, 95}, {100, 10}, {160, 80}, {90, 95}},
                {0, 1, 2},
                {3, 4, 5}},
               {"a corner touches an edge",
                {{0, 0}, {80, 0}, {80, 95}, {80, 50}, {160, 10}, {160, 95}},
                {0, 1, 2},
                {3, 4, 5}},
               {"they overlap or cross",
                {{0, 20}, {110, 5}, {60, 95}, {60, 60}, {160, 10}, {150, 95}},
                {0, 1, 2},
                {3, 4, 5}}});
}

std::string mesh_share_one() {
  return rule({{"only the vertex",
                {{80, 50}, {0, 10}, {0, 90}, {160, 10}, {160, 90}},
                {0, 1, 2},
                {0, 3, 4}},
               {"they overlap or cross",
                {{5, 50}, {150, 0}, {150, 60}, {160, 35}, {130, 95}},
                {0, 1, 2},
                {0, 3, 4}},
               {"edges on one line",
                {{5, 50}, {110, 50}, {60, 0}, {160, 50}, {80, 95}},
                {0, 1, 2},
                {0, 3, 4}}});
}

std::string mesh_share_two() {
  return rule({{"neighbors", {{80, 0}, {80, 95}, {5, 50}, {155, 50}}, {0, 1, 2}, {0, 1, 3}},
               {"folded onto each other",
                {{10, 5}, {10, 95}, {155, 40}, {110, 70}},
                {0, 1, 2},
                {0, 1, 3}}});
}

std::string mesh_share_three() {
  return rule({{"the same triangle twice", {{10, 10}, {10, 95}, {150, 50}}, {0, 1, 2}, {0, 2, 1}}});
}

std::string mesh_stages() {
  const Sheet sheet = pleated_sheet(48);
  Options options;
  options.backend = Backend::cpu;
  MeshFinder finder(options);
  const MeshResult r = finder.find({sheet.vertices, sheet.triangles});
  if (!r.ok()) throw Error(r);
  Drawing d(860, 250);
  const auto stage = [&](double x, double y, double width, const char* colour,
                         const std::string& number, const std::string& words) {
    d.rectangle(x, y, width, 62, colour);
    d.words(x + width / 2, y + 26, number, "middle");
    d.words(x + width / 2, y + 47, words, "middle");
  };
  const auto arrow = [&](double x, double y) {
    d.line(x, y, x + 28, y, grey);
    d.line(x + 20, y - 5, x + 28, y, grey);
    d.line(x + 20, y + 5, x + 28, y, grey);
  };
  stage(20, 80, 130, blue, grouped(sheet.triangles.size()), "triangles: boxes");
  arrow(154, 111);
  d.rectangle(190, 34, 480, 190, grey, 0.06);
  d.words(430, 56, "a block at a time, in the thread that finds it", "middle", grey);
  stage(205, 80, 150, green, grouped(r.candidates), "boxes that overlap");
  arrow(359, 111);
  stage(395, 80, 260, orange, grouped(r.candidates - r.exact_tests),
        "decided by filters: floats, doubles");
  stage(395, 152, 260, red, grouped(r.exact_tests), "decided by exact arithmetic");
  arrow(674, 111);
  stage(710, 80, 130, blue, grouped(r.found), "pairs");
  return d.svg();
}

}  // namespace throng::figures
