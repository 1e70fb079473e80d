// Small meshes with known pairs, in the file triangles.json of the folder THRONG_DATA.
#include <throng/throng.hpp>

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace throng::tests {
namespace {

std::vector<Pair> pairs_in(const nlohmann::json& list) {
  std::vector<Pair> pairs;
  for (const auto& p : list) pairs.push_back({p[0], p[1]});
  return pairs;
}

TEST(KnownCases, HaveTheirPairs) {
  const char* folder = std::getenv("THRONG_DATA");
  if (!folder) GTEST_SKIP() << "THRONG_DATA does not name the folder of recorded data";
  std::ifstream file(std::string(folder) + "/triangles.json");
  ASSERT_TRUE(file) << folder;
  const nlohmann::json cases = nlohmann::json::parse(file);
  EXPECT_GE(cases.size(), 21u);
  Options options;
  options.order = Order::canonical;
  for (const auto& one : cases) {
    std::vector<DoubleVec3> doubles;
    std::vector<Vec3> floats;
    for (const auto& p : one["vertices"]) {
      doubles.push_back({p[0].get<double>(), p[1].get<double>(), p[2].get<double>()});
      const DoubleVec3& d = doubles.back();
      floats.push_back({static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)});
    }
    std::vector<Triangle> triangles;
    for (const auto& t : one["triangles"]) triangles.push_back({t[0], t[1], t[2]});
    for (const Isa isa : {Isa::scalar, Isa::automatic}) {
      options.isa = isa;
      EXPECT_EQ(find_self_intersections({floats, triangles}, options),
                pairs_in(one["pairs_float32"]))
          << one["name"];
      EXPECT_EQ(find_self_intersections({doubles, triangles}, options),
                pairs_in(one["pairs_float64"]))
          << one["name"];
    }
  }
}

}  // namespace
}  // namespace throng::tests
