// The report of invalid boxes: their number and the first index.
#include "device/binning.hpp"

#include <gtest/gtest.h>

#include "support/hard_boxes.hpp"

namespace throng::device {
namespace {

TEST(Binning, AWorldBelowMinusOneIsReported) {
  const tests::BoxList boxes = tests::uniform_boxes(50, 1), second = tests::uniform_boxes(20, 2);
  std::vector<std::int32_t> worlds(50, -1), of_second(20, 3);
  Boxes a = boxes, b = second;
  a.filters.world = {worlds.data(), worlds.size()};
  b.filters.world = {of_second.data(), of_second.size()};
  const auto report_of = [&] {
    const Input in = make_input(a, &b, {});
    Report report;
    for (std::uint32_t i = 0; i < in.count; ++i) report_bad_world(in, report, i);
    return report;
  };
  EXPECT_EQ(report_of().bad_worlds, 0u);
  of_second[7] = -2;
  EXPECT_EQ(report_of().bad_worlds, 1u);
  EXPECT_EQ(report_of().first_bad_world(), 57u);
  worlds[31] = std::numeric_limits<std::int32_t>::min();
  worlds[30] = -2;
  EXPECT_EQ(report_of().bad_worlds, 3u);
  EXPECT_EQ(report_of().first_bad_world(), 30u);
}

TEST(Binning, InactiveBoxesAreReported) {
  Report report;
  report_inactive(report, 4, false);
  EXPECT_EQ(report.inactive, 1u);
  EXPECT_EQ(report.nan_count, 0u);
  for (const std::uint32_t i : {9u, 5u, 70u}) report_inactive(report, i, true);
  EXPECT_EQ(report.inactive, 4u);
  EXPECT_EQ(report.nan_count, 3u);
  EXPECT_EQ(report.first_nan(), 5u);
}

}  // namespace
}  // namespace throng::device
