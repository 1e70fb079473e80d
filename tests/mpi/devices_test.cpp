// The assignment of GPUs to ranks.
#include <gtest/gtest.h>

#include "ranks/devices.hpp"

namespace throng::ranks {
namespace {

TEST(Devices, AreTakenInTurnByTheRanksOfAMachine) {
  EXPECT_EQ(device_for("0", nullptr, 4), "0");
  EXPECT_EQ(device_for("3", nullptr, 4), "3");
  EXPECT_EQ(device_for("6", nullptr, 4), "2");
  EXPECT_EQ(device_for("0", "2,5", 8), "2");
  EXPECT_EQ(device_for("1", "2,5", 8), "5");
  EXPECT_EQ(device_for("2", "2,5", 8), "2");
  EXPECT_EQ(device_for("1", "GPU-4c,GPU-a7,MIG-11", 0), "GPU-a7");
}

TEST(Devices, AreLeftAsTheyAreWhereThereIsNoChoice) {
  EXPECT_EQ(device_for("1", nullptr, 0), "");
  EXPECT_EQ(device_for("1", nullptr, 1), "");
  EXPECT_EQ(device_for("1", "3", 8), "");
  EXPECT_EQ(device_for("1", "", 8), "");
  EXPECT_EQ(device_for(nullptr, "0,1", 8), "");
  for (const char* odd : {"", "x", "1x", "99999999999999999999999"}) {
    EXPECT_EQ(device_for(odd, "0,1", 2), "") << odd;
  }
}

}  // namespace
}  // namespace throng::ranks
