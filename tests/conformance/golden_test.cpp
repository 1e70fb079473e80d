// The pairs of the scenes are byte-identical for every compiler, optimization level and machine,
// every instruction set, 1 to 8 threads, brute force, and the GPU.
#include "apps/scenes/golden.hpp"

#include <cstdlib>

#include <throng/checksum.hpp>

#include "apps/scenes/scene.hpp"
#include "support/configs.hpp"
#include "support/scene_boxes.hpp"
#include "support/vectorized_reference.hpp"

namespace throng::tests {
namespace {

SceneBoxes boxes_of(const scenes::Golden& golden) {
  scenes::Spec spec;
  spec.name = golden.scene;
  spec.objects = golden.objects;
  spec.frames = golden.frame + 1;
  return SceneBoxes(spec, golden.frame);
}

void expect_golden(const scenes::Golden& want, const SceneBoxes& scene, const Config& config) {
  SCOPED_TRACE(std::string(want.scene) + " " + std::to_string(want.objects) + " " + config.name());
  Finder finder(config.options());
  const Result result = finder.find(scene.view());
  ASSERT_TRUE(result.ok()) << result.message;
  const Pairs pairs = finder.pairs();
  EXPECT_EQ(pairs.size(), want.pairs);
  EXPECT_EQ(pair_checksum(pairs.data(), pairs.size()), want.checksum);
  if (config.order == Order::canonical) {
    EXPECT_EQ(scenes::sequence_checksum(pairs.data(), pairs.size()), want.canonical);
  }
}

class Golden : public testing::TestWithParam<scenes::Golden> {};

// The library printed the table once. This proves it: the double loop gives the same numbers.
TEST_P(Golden, MatchTheDoubleLoop) {
  const scenes::Golden& want = GetParam();
  const SceneBoxes scene = boxes_of(want);
  VectorizedReference loop;
  loop.run(scene.view(), scene.view(), false, 0);
  const std::vector<Pair>& pairs = loop.pairs();
  EXPECT_EQ(pairs.size(), want.pairs);
  EXPECT_EQ(pair_checksum(pairs.data(), pairs.size()), want.checksum);
  EXPECT_EQ(scenes::sequence_checksum(pairs.data(), pairs.size()), want.canonical);
}

TEST_P(Golden, SameBytesForAllConfigs) {
  const scenes::Golden& want = GetParam();
  const SceneBoxes scene = boxes_of(want);
  for (const Isa isa : supported_isas())
    for (unsigned threads = 1; threads <= 8; threads += sanitized ? 3 : 1)
      expect_golden(want, scene, {Algorithm::grid, isa, threads, Order::canonical});
  expect_golden(want, scene, {Algorithm::grid, Isa::automatic, 0, Order::any});
  if (want.objects <= 1000)
    for (const Isa isa : supported_isas())
      expect_golden(want, scene, {Algorithm::all_pairs, isa, 2, Order::canonical});
  expect_golden(want, scene,
                {Algorithm::grid, Isa::scalar, 2, Order::canonical, Backend::emulated});
  if (cuda::available().ok())
    expect_golden(want, scene, {Algorithm::grid, Isa::scalar, 0, Order::canonical, Backend::cuda});
}

// THRONG_GOLDEN: the largest scene to run; the table goes to a million boxes.
std::vector<scenes::Golden> small_ones() {
  const char* wanted = std::getenv("THRONG_GOLDEN");
  const std::size_t most = wanted ? std::strtoull(wanted, nullptr, 10) : sanitized ? 1000 : 10000;
  std::vector<scenes::Golden> small;
  for (const scenes::Golden& golden : scenes::golden()) {
    if (golden.objects <= most) small.push_back(golden);
  }
  return small;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Golden, testing::ValuesIn(small_ones()), [](const auto& which) {
  std::string name = which.param.scene + std::string("_") + std::to_string(which.param.objects);
  for (char& c : name) {
    if (c == '-') c = '_';
  }
  return name;
});

// Each scene is present, and the table's checksums differ from one another.
TEST(GoldenTable, HasEveryScene) {
  std::vector<std::uint64_t> seen;
  for (const std::string& name : scenes::names()) {
    std::size_t rows = 0;
    for (const scenes::Golden& golden : scenes::golden()) {
      if (name != golden.scene) continue;
      ++rows;
      seen.push_back(golden.canonical);
    }
    EXPECT_EQ(rows, 4u) << name;
  }
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::adjacent_find(seen.begin(), seen.end()), seen.end());
}

// Another order, or another pair, changes the checksum.
TEST(GoldenTable, ChecksumDependsOnOrder) {
  const Pair pairs[3] = {{0, 1}, {0, 2}, {1, 2}}, other[3] = {{0, 2}, {0, 1}, {1, 2}};
  EXPECT_NE(scenes::sequence_checksum(pairs, 3), scenes::sequence_checksum(other, 3));
  EXPECT_EQ(pair_checksum(pairs, 3), pair_checksum(other, 3));
  EXPECT_NE(scenes::sequence_checksum(pairs, 3), scenes::sequence_checksum(pairs, 2));
}

}  // namespace
}  // namespace throng::tests
