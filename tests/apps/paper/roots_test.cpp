// Fast square roots: their accuracy, Table 3 of the paper, and the effect of the repairs.
#include "apps/paper/roots.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "apps/paper/root_shares.hpp"
#include "apps/paper/stepper.hpp"
#include "apps/paper/variant.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

using Counts = std::vector<std::uint64_t>;
const Counts tests_to_1m = {1000, 10000, 100000, 1000000};

double largest_error(std::uint32_t constant, int steps) {
  double largest = 0;
  for (float x = 1; x < 4; x = std::nextafter(x, 8.0f) + 0x1p-18f) {
    const double exact = 1 / std::sqrt(static_cast<double>(x));
    const double got = static_cast<double>(fast_inverse_root<double>(x, constant, steps));
    largest = std::max(largest, std::fabs(got / exact - 1));
  }
  return largest;
}

// Lomont's own figures: 0.00175228 and 0.00175124 after one step, and his constant the better one.
TEST(Roots, OneStepErrsAsPublished) {
  EXPECT_NEAR(largest_error(carmack_constant, 1), 0.00175228, 2e-7);
  EXPECT_NEAR(largest_error(lomont_constant, 1), 0.00175124, 2e-7);
  EXPECT_LT(largest_error(carmack_constant, 2), 5e-6);
  EXPECT_LT(largest_error(carmack_constant, 3), 1e-7);
  EXPECT_GT(largest_error(carmack_constant, 0), 0.03);
}

// Table 3, in counts instead of %, to its printed digits. Two rows, with different last operations.
TEST(Roots, TableThreeWithTwoStepsIsAProduct) {
  EXPECT_EQ(wrong_roots({carmack_constant, 2, true, LastOperation::product}, tests_to_1m),
            (Counts{29, 89, 270, 1800}));
  EXPECT_EQ(wrong_roots({lomont_constant, 2, true, LastOperation::product}, tests_to_1m),
            (Counts{29, 89, 270, 1803}));
  EXPECT_EQ(wrong_roots({carmack_constant, 2, true, LastOperation::product}, {10000000}),
            Counts{36810});
}

TEST(Roots, TableThreeWithThreeStepsIsAReciprocal) {
  for (const std::uint32_t constant : {carmack_constant, lomont_constant}) {
    const Counts wrong = wrong_roots({constant, 3, true, LastOperation::reciprocal}, tests_to_1m);
    EXPECT_EQ(wrong[0], 7u);
    EXPECT_EQ(wrong[1], 12u);
    EXPECT_EQ(wrong[2], 35u);
    EXPECT_NEAR(static_cast<double>(wrong[3]), 110, 1);
    EXPECT_EQ(wrong_roots({constant, 4, true, LastOperation::reciprocal}, tests_to_1m), wrong);
  }
}

// Neither row matches with the other last operation, or with steps in float.
TEST(Roots, TableThreeMatchesNoOtherDefinition) {
  EXPECT_EQ(wrong_roots({carmack_constant, 2, true, LastOperation::reciprocal}, {1000}), Counts{0});
  EXPECT_EQ(wrong_roots({carmack_constant, 3, true, LastOperation::product}, {1000}), Counts{0});
  EXPECT_EQ(wrong_roots({carmack_constant, 2, false, LastOperation::product}, {1000, 100000}),
            (Counts{30, 279}));
  EXPECT_EQ(wrong_roots({carmack_constant, 3, false, LastOperation::reciprocal}, {1000}),
            Counts{9});
}

Variant fast(RootKind root, int steps, bool repair) {
  Variant variant;
  variant.root = root;
  variant.steps = steps;
  variant.repair = repair;
  return variant;
}

// The walk from the ends of rows finds every wrong index: compared with all indices.
TEST(MappingErrors, WalkMatchesAllIndices) {
  const std::uint64_t n = 2500;
  for (const RootKind root : {RootKind::carmack, RootKind::lomont, RootKind::float32})
    for (int steps = 2; steps <= 4; ++steps) {
      const Variant variant = fast(root, steps, false);
      std::uint64_t wrong = 0;
      with_mapping(variant, nullptr, [&](const auto& mapping) {
        for (std::uint64_t k = 0; k < base::pair_count(n); ++k) {
          Pair got{};
          wrong += !(mapping(k, n, got) && got == base::pair_of_row_index(k, n));
        }
      });
      EXPECT_EQ(count_errors(variant, n).indices, wrong) << describe(variant);
      EXPECT_EQ(wrong > 0, root != RootKind::float32);
    }
}

TEST(MappingErrors, RepairsFixRowsOffByOne) {
  for (const std::uint64_t n : {1000u, 4098u, 10000u, 100000u}) {
    for (const RootKind root : {RootKind::carmack, RootKind::lomont})
      for (int steps = 2; steps <= 4; ++steps) {
        EXPECT_GT(count_errors(fast(root, steps, false), n, 1).rows, 0u) << steps << " n " << n;
        EXPECT_EQ(count_errors(fast(root, steps, true), n, 1).rows, 0u) << steps << " n " << n;
      }
    EXPECT_EQ(count_errors(fast(RootKind::float32, 2, true), n, 1).rows, 0u) << n;
  }
}

// With one step the row is off by more than one from small n on; with two steps from about 200,000.
TEST(MappingErrors, RepairsFixNoLargerErrors) {
  EXPECT_GT(count_errors(fast(RootKind::carmack, 1, true), 1000, 1).rows, 0u);
  EXPECT_GT(count_errors(fast(RootKind::carmack, 2, true), 1000000, 1).rows, 0u);
  EXPECT_EQ(count_errors(fast(RootKind::carmack, 3, true), 1000000, 1).rows, 0u);
}

TEST(MappingErrors, ExactMappingsHaveNone) {
  for (const std::uint64_t n : {0u, 1u, 2u, 4098u, 100000u}) {
    Variant variant;
    variant.root = RootKind::exact;
    EXPECT_EQ(count_errors(variant, n).indices, 0u);
    variant.mapping = MappingKind::fold;
    EXPECT_EQ(count_errors(variant, n).indices, 0u);
  }
}

// The timed work is the stated work: the sums are those of the roots.
TEST(RootTimes, SumOfIntegerRoots) {
  std::uint64_t sum = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    sum += static_cast<std::uint64_t>(std::sqrt(static_cast<double>(i)));
  }
  for (const unsigned threads : {1u, 3u}) {
    EXPECT_EQ(time_roots_on_host(RootKind::float64, 1, 20000, 1, threads).sum, sum);
    EXPECT_EQ(time_roots_on_host(RootKind::float32, 1, 20000, 1, threads).sum, sum);
  }
  const RootTime fast = time_roots_on_host(RootKind::carmack, 2, 20000, 3, 1);
  EXPECT_NE(fast.sum, sum);
  EXPECT_NEAR(static_cast<double>(fast.sum), static_cast<double>(sum), 200);
  EXPECT_GT(fast.ms, 0);
}

}  // namespace
}  // namespace throng::paper
