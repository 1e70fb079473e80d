// Counts and bytes on the command line, the median, and sibling programs.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "apps/common/failure.hpp"
#include "apps/common/failure_text.hpp"
#include "apps/common/median.hpp"
#include "apps/common/numbers.hpp"
#include "apps/common/sibling_program.hpp"

namespace throng::common {
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
    const auto value = parse(text, "--the-option");
    ADD_FAILURE() << "'" << text << "' was taken for " << value;
  } catch (const Failure& failure) {
    const std::string said = failure.what();
    EXPECT_NE(said.find("--the-option: found '" + text + "', wanted "), std::string::npos) << said;
    EXPECT_EQ(failure.status(), exit_bad);
  }
}

TEST(Numbers, OthersAreRefused) {
  const auto count = [](const std::string& text, const std::string& option) {
    return parse_count(text, option);
  };
  for (const char* text : {"", "K", "-1", "+1", " 1", "1 ", "1.5", "0.0001K", "1X", "1KK", "nan",
                           "inf", "0x", "1e300", "9007199254740992", "10T T"}) {
    refuses(count, text);
    refuses(parse_bytes, text);
  }
  refuses(count, "64MB");
  refuses(count, "5B");
  refuses(parse_bytes, "5X");
  refuses(parse_bytes, "5MBB");
}

TEST(Numbers, HaveARange) {
  EXPECT_EQ(parse_count("1K", "--n", 1, 1000), 1000u);
  EXPECT_EQ(parse_threads("0", "--n"), 0u);
  EXPECT_EQ(parse_threads("64", "--n"), 64u);
  const auto ranged = [](const std::string& text, const std::string& option) {
    return parse_count(text, option, 1, 1000);
  };
  for (const char* text : {"0", "1001", "2K", "-1", "x", ""}) refuses(ranged, text);
  for (const char* text : {"-1", "4294967296", "many"}) refuses(parse_threads, text);
}

TEST(Numbers, RealNumbersHaveARange) {
  const auto share = [](const std::string& text, const std::string& option) {
    return parse_number(text, option, 0, 1, "0 to 1");
  };
  EXPECT_EQ(share("0", "--n"), 0);
  EXPECT_EQ(share("1", "--n"), 1);
  EXPECT_EQ(share("2.5e-1", "--n"), 0.25);
  for (const char* text :
       {"", "1.01", "-0.1", "nan", "inf", "much", "0.5x", " 0.5", "0.5 ", "1e999"})
    refuses(share, text);
}

// Upward, so that no pair is lost, and never to infinity.
TEST(Numbers, MarginsAreFloats) {
  const std::pair<const char*, float> exact[] = {
      {"0", 0.0f}, {"0.5", 0.5f}, {"1e3", 1000.0f}, {"3.4028234663852886e38", 0x1.fffffep127f}};
  for (const auto& [text, margin] : exact) EXPECT_EQ(parse_margin(text, "--margin"), margin);
  EXPECT_GE(static_cast<double>(parse_margin("0.1", "--margin")), 0.1);
  EXPECT_LT(static_cast<double>(parse_margin("0.1", "--margin")), 0.10000001);
  EXPECT_GT(parse_margin("1e-60", "--margin"), 0);
  for (const char* text : {"1e39", "3.4028236e38", "-1", "nan", "inf", "-inf", "0.1m", "1e999", ""})
    refuses(parse_margin, text);
}

TEST(Numbers, SeedsDoNotWrap) {
  EXPECT_EQ(parse_seed("0", "--n"), 0u);
  EXPECT_EQ(parse_seed("18446744073709551615", "--n"), ~std::uint64_t{0});
  for (const char* text : {"-1", "18446744073709551616", "1K", "1.0", " 1", "", "x"})
    refuses(parse_seed, text);
}

TEST(Median, OfOddAndEvenNumbers) {
  EXPECT_EQ(median({}), 0);
  EXPECT_EQ(median({7}), 7);
  EXPECT_EQ(median({9, 1}), 5);
  EXPECT_EQ(median({9, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 9, 2}), 3);
  EXPECT_EQ(median({5, 5, 5, 1}), 5);
}

Result failed(Status status, const std::string& message) {
  Result result;
  result.status = status;
  message.copy(result.message, sizeof result.message - 1);
  return result;
}

TEST(FailureText, NamesTheCommandsOption) {
  const Result nan = failed(Status::nan_box, "2 boxes have a NaN; fix them by Options::nan");
  EXPECT_EQ(failure_text(nan, {}), "2 boxes have a NaN; fix them");
  EXPECT_EQ(failure_text(nan, {.nan = true}),
            "2 boxes have a NaN; fix them, or treat them as inactive by --nan inactive");
  const Result device = failed(Status::no_device, "no GPU: a; b; use Backend::cpu");
  EXPECT_EQ(failure_text(device, {.backend = true}).rfind("no GPU: a; b; use --backend cpu", 0),
            0u);
  const Result memory = failed(Status::out_of_memory, "");
  EXPECT_EQ(failure_text(memory, {}), "out of memory; split the boxes");
  EXPECT_EQ(failure_text(memory, {.memory = true}),
            "out of memory; bound it by --memory, or split the boxes");
}

TEST(FailureText, KeepsLanguageNeutralHints) {
  const std::string text = "the margin is -1; it must be finite and not negative";
  EXPECT_EQ(failure_text(failed(Status::bad_option, text), {.nan = true}), text);
  EXPECT_EQ(failure_text(failed(Status::busy, ""), {}), "busy");
}

TEST(FailureText, IsaHintDependsOnItsSource) {
  const Result isa = failed(Status::unsupported_isa, "'named' (asked for by THRONG_ISA); use auto");
  EXPECT_EQ(failure_text(isa, {}), isa.message);
  EXPECT_NE(failure_text(isa, {.isa = "neon"}).find("--isa: found neon"), std::string::npos);
}

TEST(SiblingProgram, IsInTheSameFolder) {
  const std::string path = find_sibling_program("common_test");
  ASSERT_FALSE(path.empty());
  EXPECT_EQ(std::filesystem::path(path).stem().string(), "common_test");
  EXPECT_EQ(find_sibling_program("no-such-program"), "");
  EXPECT_EQ(find_sibling_program("."), "");
}

TEST(Failure, HasAStatus) {
  EXPECT_EQ(Failure("x").status(), exit_bad);
  EXPECT_EQ(Failure("x", 130).status(), 130);
}

}  // namespace
}  // namespace throng::common
