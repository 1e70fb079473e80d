// Small meshes with known pairs, in the file triangles.json of the folder THRONG_DATA.
#include <throng/throng.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "mesh/mesh_cases.hpp"

namespace throng::tests {
namespace {

struct KnownCase {
  std::string name;
  std::vector<DoubleVec3> doubles;
  std::vector<Vec3> floats;
  std::vector<Triangle> triangles;
  std::vector<Pair> pairs_of_floats, pairs_of_doubles;
};

std::vector<Pair> pairs_in(const nlohmann::json& list) {
  std::vector<Pair> pairs;
  for (const auto& p : list) pairs.push_back({p[0], p[1]});
  return pairs;
}

class KnownCases : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("THRONG_DATA");
    if (!folder) GTEST_SKIP() << "THRONG_DATA does not name the folder of recorded data";
    std::ifstream file(std::string(folder) + "/triangles.json");
    ASSERT_TRUE(file) << folder;
    for (const auto& recorded : nlohmann::json::parse(file)) {
      KnownCase one;
      one.name = recorded["name"];
      for (const auto& p : recorded["vertices"])
        one.doubles.push_back({p[0].get<double>(), p[1].get<double>(), p[2].get<double>()});
      one.floats = to_floats(one.doubles);
      for (const auto& t : recorded["triangles"]) one.triangles.push_back({t[0], t[1], t[2]});
      one.pairs_of_floats = pairs_in(recorded["pairs_float32"]);
      one.pairs_of_doubles = pairs_in(recorded["pairs_float64"]);
      cases.push_back(one);
    }
    EXPECT_GE(cases.size(), 21u);
  }

  std::vector<KnownCase> cases;
};

TEST_F(KnownCases, HaveTheirPairs) {
  Options options;
  options.order = Order::canonical;
  for (const KnownCase& one : cases) {
    for (const Isa isa : {Isa::scalar, Isa::automatic}) {
      options.isa = isa;
      EXPECT_EQ(find_self_intersections({one.floats, one.triangles}, options), one.pairs_of_floats)
          << one.name;
      EXPECT_EQ(find_self_intersections({one.doubles, one.triangles}, options),
                one.pairs_of_doubles)
          << one.name;
    }
  }
}

TEST_F(KnownCases, AreDescribed) {
  struct Wanted {
    const char* name;
    IntersectionKind kind;
    int points;
  };
  const Wanted wanted[] = {
      {"coplanar in y, one common point by position (axom 152)", IntersectionKind::coplanar, 3},
      {"coplanar, missed by a published case table (fast-triangle-triangle-intersection 4)",
       IntersectionKind::coplanar, 4},
      {"coplanar, missed by the paper itself (fast-triangle-triangle-intersection 3)",
       IntersectionKind::coplanar, 4},
      {"a point and a segment, common end (geometry3Sharp 85)", IntersectionKind::coplanar, 1},
      {"one edge shared, folded onto itself", IntersectionKind::coplanar, 3},
      {"one vertex shared, crossing", IntersectionKind::crossing, 2},
      {"one vertex shared, coplanar, overlapping", IntersectionKind::coplanar, 3},
      {"one vertex shared, edges on one line and overlapping", IntersectionKind::touching, 2},
      {"no vertex shared, corner touches a face", IntersectionKind::touching, 1},
      {"no vertex shared, edges cross in one point", IntersectionKind::touching, 2},
      {"no vertex shared, same positions", IntersectionKind::coplanar, 3},
      {"the same three vertices, other winding", IntersectionKind::coplanar, 3},
      {"huge, crossing", IntersectionKind::crossing, 2},
  };
  std::size_t described = 0;
  for (const KnownCase& one : cases) {
    const auto check = [&](const TriangleMesh& mesh, const std::vector<Pair>& pairs) {
      for (const Pair& pair : pairs) {
        const auto d = describe_intersections(mesh, mesh, &pair, 1).at(0);
        const auto* const w = std::find_if(std::begin(wanted), std::end(wanted),
                                           [&](const Wanted& x) { return one.name == x.name; });
        ASSERT_NE(w, std::end(wanted)) << one.name;
        EXPECT_EQ(d.kind, w->kind) << one.name;
        EXPECT_EQ(d.point_count, w->points) << one.name;
        ++described;
      }
    };
    check({one.floats, one.triangles}, one.pairs_of_floats);
    check({one.doubles, one.triangles}, one.pairs_of_doubles);
  }
  EXPECT_EQ(described, 2 * std::size(wanted));
}

}  // namespace
}  // namespace throng::tests
