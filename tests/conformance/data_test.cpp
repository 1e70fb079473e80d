// Recorded boxes with known pairs, in the folder THRONG_DATA.
#include <algorithm>
#include <cstdlib>
#include <iterator>

#include <throng/checksum.hpp>

#include "apps/scenes/npy.hpp"
#include "support/configs.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

struct Recording {
  const char* file;
  std::size_t boxes;
  std::uint64_t pairs, checksum;
};

constexpr Recording recordings[] = {
    {"bounds01.npy", 288, 650, 0x12029a319c1d783f},
    {"bounds02.npy", 4221, 14969, 0x8a5b4278ca3373ad},
    {"cloth-funnel.npy", 55864, 805888, 0x9e35f6c6f96859f1},
    {"armadillo-rollers.npy", 72740, 21238811, 0xb7af7b4bb2e4f53e},
    {"cloth-ball.npy", 277653, 25057379, 0x5a85b9fc39dfdfa5},
};

class Data : public testing::TestWithParam<Recording> {};

TEST_P(Data, HasTheKnownPairs) {
  const char* folder = std::getenv("THRONG_DATA");
  if (!folder) GTEST_SKIP() << "THRONG_DATA does not name the folder of recorded boxes";
  const Recording& r = GetParam();
  const scenes::BoxFile file = scenes::read_boxes(std::string(folder) + "/" + r.file);
  ASSERT_EQ(file.frames, 1u);
  ASSERT_EQ(file.count, r.boxes);
  const Boxes boxes(file.frame(0), file.count);
  std::vector<Pair> pairs(r.pairs);
  for (const Config& config : all_configs()) {
    // Brute force if it takes less than a second; canonical order once per instruction set.
    if (config.algorithm == Algorithm::all_pairs && r.boxes > 5000) continue;
    if (config.order == Order::canonical && config.threads != 2 && r.boxes > 5000) continue;
    SCOPED_TRACE(config.name());
    Finder finder(config.options());
    const Result result = finder.find(boxes, pairs.data(), pairs.size());
    ASSERT_TRUE(result.ok()) << result.message;
    EXPECT_EQ(result.found, r.pairs);
    EXPECT_EQ(pair_checksum(pairs.data(), pairs.size()), r.checksum);
    EXPECT_EQ(result.inactive, 0u);
    if (config.order == Order::canonical) {
      EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
    }
  }
}

// Layers that collide with all others, static boxes, and worlds: the allowed part of the known
// pairs.
TEST_P(Data, FiltersLeaveTheirPairs) {
  const char* folder = std::getenv("THRONG_DATA");
  if (!folder) GTEST_SKIP() << "THRONG_DATA does not name the folder of recorded boxes";
  const Recording& r = GetParam();
  const scenes::BoxFile file = scenes::read_boxes(std::string(folder) + "/" + r.file);
  const Boxes boxes(file.frame(0), file.count);
  Random random(r.boxes);
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> world;
  std::vector<std::uint8_t> is_static;
  for (std::size_t i = 0; i < file.count; ++i) {
    group.push_back(1u << random.below(6));
    mask.push_back(0x3f ^ group.back());
    world.push_back(random.one_in(5000) ? -1 : random.between(0, 2));
    is_static.push_back(random.below(10) < 4);
  }
  std::vector<Pair> all(r.pairs), pairs(r.pairs);
  ASSERT_TRUE(Finder().find(boxes, all.data(), all.size()).ok());
  const auto left = [&](const auto& allowed) {
    std::vector<Pair> kept;
    std::copy_if(all.begin(), all.end(), std::back_inserter(kept), allowed);
    return kept;
  };
  struct Case {
    Boxes boxes;
    std::vector<Pair> left;
  };
  std::vector<Case> cases(3, {boxes, {}});
  cases[0].boxes.filters.group = {group.data(), group.size()};
  cases[0].boxes.filters.mask = {mask.data(), mask.size()};
  cases[0].left = left([&](Pair p) { return (group[p.first] & mask[p.second]) != 0; });
  cases[1].boxes.filters.is_static = {is_static.data(), is_static.size()};
  cases[1].left = left([&](Pair p) { return !is_static[p.first] || !is_static[p.second]; });
  cases[2].boxes.filters.world = {world.data(), world.size()};
  cases[2].left = left([&](Pair p) {
    const std::int32_t a = world[p.first], b = world[p.second];
    return a == b || a == -1 || b == -1;
  });
  for (const Config& config : all_configs()) {
    if (config.algorithm == Algorithm::all_pairs || config.order == Order::canonical) continue;
    SCOPED_TRACE(config.name());
    Finder finder(config.options());
    for (const Case& c : cases) {
      const Result result = finder.find(c.boxes, pairs.data(), pairs.size());
      ASSERT_TRUE(result.ok()) << result.message;
      ASSERT_EQ(result.found, c.left.size());
      EXPECT_EQ(pair_checksum(pairs.data(), c.left.size()),
                pair_checksum(c.left.data(), c.left.size()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Recorded, Data, testing::ValuesIn(recordings), [](const auto& which) {
  std::string name = which.param.file;
  for (char& c : name) {
    if (c == '-' || c == '.') c = '_';
  }
  return name;
});

}  // namespace
}  // namespace throng::tests
