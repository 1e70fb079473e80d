// The assignment of GPUs to ranks.
#include <gtest/gtest.h>

#include "apps/mpi/devices.hpp"

namespace throng::mpi_app {
namespace {

TEST(Devices, AreAssignedRoundRobin) {
  EXPECT_EQ(device_for("0", nullptr, 4), "0");
  EXPECT_EQ(device_for("3", nullptr, 4), "3");
  EXPECT_EQ(device_for("6", nullptr, 4), "2");
  EXPECT_EQ(device_for("0", "2,5", 8), "2");
  EXPECT_EQ(device_for("1", "2,5", 8), "5");
  EXPECT_EQ(device_for("2", "2,5", 8), "2");
  EXPECT_EQ(device_for("1", "GPU-4c,GPU-a7,MIG-11", 0), "GPU-a7");
}

TEST(Devices, AreUnchangedWithoutAChoice) {
  EXPECT_EQ(device_for("1", nullptr, 0), "");
  EXPECT_EQ(device_for("1", nullptr, 1), "");
  EXPECT_EQ(device_for("1", "3", 8), "");
  EXPECT_EQ(device_for("1", "", 8), "");
  EXPECT_EQ(device_for(nullptr, "0,1", 8), "");
  for (const char* invalid : {"", "x", "1x", "99999999999999999999999"}) {
    EXPECT_EQ(device_for(invalid, "0,1", 2), "") << invalid;
  }
}

}  // namespace
}  // namespace throng::mpi_app
