// Recorded boxes with known answers, in the folder that THRONG_DATA names.
#include <cstdlib>

#include "scene/checksum.hpp"
#include "scene/npy.hpp"
#include "support/configs.hpp"

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
  const scene::BoxFile file = scene::read_boxes(std::string(folder) + "/" + r.file);
  ASSERT_EQ(file.frames, 1u);
  ASSERT_EQ(file.count, r.boxes);
  const Boxes boxes(file.frame(0), file.count);
  std::vector<Pair> pairs(r.pairs);
  for (const Config& config : all_configs()) {
    // Brute force where it takes less than a second; canonical order once an instruction set.
    if (config.algorithm == Algorithm::all_pairs && r.boxes > 5000) continue;
    if (config.order == Order::canonical && config.threads != 2 && r.boxes > 5000) continue;
    SCOPED_TRACE(config.name());
    Finder finder(config.options());
    const Result result = finder.find(boxes, pairs.data(), pairs.size());
    ASSERT_TRUE(result.ok()) << result.message;
    EXPECT_EQ(result.found, r.pairs);
    EXPECT_EQ(scene::pair_checksum(pairs.data(), pairs.size()), r.checksum);
    EXPECT_EQ(result.inactive, 0u);
    if (config.order == Order::canonical) {
      EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
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
