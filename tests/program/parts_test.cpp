// Counts and bytes as people write them, the median, and what stands beside a program.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "program/companion.hpp"
#include "program/failure.hpp"
#include "program/median.hpp"
#include "program/numbers.hpp"

namespace throng::program {
namespace {

TEST(Numbers, Counts) {
  const std::pair<const char*, std::uint64_t> good[] = {
      {"0", 0},
      {"100000", 100000},
      {"100K", 100000},
      {"100k", 100000},
      {"2.5M", 2500000},
      {"1e3", 1000},
      {"1m", 1000000},
      {"4G", 4000000000},
      {"2T", 2000000000000},
      {"9007199254740991", 9007199254740991},
  };
  for (const auto& [text, value] : good) EXPECT_EQ(parse_count(text, "--n"), value) << text;
}

TEST(Numbers, Bytes) {
  const std::pair<const char*, std::uint64_t> good[] = {
      {"17", 17},
      {"17B", 17},
      {"64M", 64 << 20},
      {"64MB", 64 << 20},
      {"64MiB", 64 << 20},
      {"1.5k", 1536},
      {"2G", std::uint64_t{2} << 30},
      {"1TiB", std::uint64_t{1} << 40},
  };
  for (const auto& [text, value] : good) EXPECT_EQ(parse_bytes(text, "--cap"), value) << text;
}

template <class Parse>
void refuses(Parse parse, const std::string& text) {
  try {
    const std::uint64_t value = parse(text, "--the-option");
    ADD_FAILURE() << "'" << text << "' was taken for " << value;
  } catch (const Failure& failure) {
    const std::string said = failure.what();
    EXPECT_NE(said.find("--the-option: found '" + text + "', wanted "), std::string::npos) << said;
    EXPECT_EQ(failure.status(), exit_bad);
  }
}

TEST(Numbers, OthersAreRefused) {
  for (const char* text : {"", "K", "-1", "+1", " 1", "1 ", "1.5", "0.0001K", "1X", "1KK", "nan",
                           "inf", "0x", "1e300", "9007199254740992", "10T T"}) {
    refuses(parse_count, text);
    refuses(parse_bytes, text);
  }
  refuses(parse_count, "64MB");
  refuses(parse_count, "5B");
  refuses(parse_bytes, "5X");
  refuses(parse_bytes, "5MBB");
}

TEST(Median, OfOddAndEvenNumbers) {
  EXPECT_EQ(median({}), 0);
  EXPECT_EQ(median({7}), 7);
  EXPECT_EQ(median({9, 1}), 5);
  EXPECT_EQ(median({9, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 9, 2}), 3);
  EXPECT_EQ(median({5, 5, 5, 1}), 5);
}

TEST(Companion, StandsInTheSameFolder) {
  const std::string path = find_companion("program_test");
  ASSERT_FALSE(path.empty());
  EXPECT_EQ(std::filesystem::path(path).stem().string(), "program_test");
  EXPECT_EQ(find_companion("no-such-program"), "");
  EXPECT_EQ(find_companion("."), "");
}

TEST(Failure, HasAStatus) {
  EXPECT_EQ(Failure("x").status(), exit_bad);
  EXPECT_EQ(Failure("x", 130).status(), 130);
}

}  // namespace
}  // namespace throng::program
