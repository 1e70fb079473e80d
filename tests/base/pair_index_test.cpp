// The pair numberings against stepwise sums, at the first and last index of every row: an error of
// the root shows only there.
#include "base/pair_index.hpp"

#include <gtest/gtest.h>

#include <cfenv>
#include <cstdint>
#include <vector>

namespace throng::base {
namespace {

static_assert(pair_count(0) == 0 && pair_count(1) == 0 && pair_count(2) == 1);
static_assert(pair_count(4294967296u) == 9223372034707292160u);
static_assert(pair_of_column_index(0) == Pair{0, 1});
static_assert(pair_of_column_index(9223372034707292159u) == Pair{4294967294u, 4294967295u});
// The paper's two examples, which count from 1.
static_assert(pair_of_row_index(71452, 1000) == Pair{75 - 1, 303 - 1});
static_assert(pair_of_row_index(46108, 1000) == Pair{48 - 1, 285 - 1});

const std::uint64_t hard_counts[] = {
    2,          3,          31,         32,         4097,      4098,      4609,
    5793,       5794,       23170,      23171,      46341,     46342,     46343,
    65536,      65537,      92682,      92683,      94906267,  117440513, 117440514,
    1518500251, 2147483647, 2147483648, 4294967294, 4294967295};

// Every row if that is fast, else the first and last 50,000 and some thousand between.
std::vector<std::uint64_t> rows_to_test(std::uint64_t n) {
  std::vector<std::uint64_t> rows;
  const std::uint64_t dense = 50000, last = n - 1;
  const std::uint64_t step = n < 200000 ? 1 : n / 20011;
  for (std::uint64_t i = 0; i < last; i += i < dense || i + dense >= last ? 1 : step) {
    if (i >= dense && i + dense < last && i + dense + step >= last && step > 1) i = last - dense;
    rows.push_back(i);
  }
  return rows;
}

void expect_row_pair(std::uint64_t k, std::uint64_t n, std::uint64_t i, std::uint64_t j) {
  const Pair want{static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)};
  const Pair got = pair_of_row_index(k, n);
  ASSERT_TRUE(got == want) << "k " << k << " n " << n << ": (" << got.first << ", " << got.second
                           << ") instead of (" << i << ", " << j << ")";
  ASSERT_EQ(row_index(want.first, want.second, n), k) << "i " << i << " j " << j << " n " << n;
}

class HardCount : public testing::TestWithParam<std::uint64_t> {};

TEST_P(HardCount, FirstAndLastOfRows) {
  const std::uint64_t n = GetParam();
  for (const std::uint64_t i : rows_to_test(n)) {
    // In 128 bits: a form that cannot overflow, in the opposite order to the library's.
    const auto start =
        static_cast<std::uint64_t>((static_cast<unsigned __int128>(i) * (2 * n - i - 1)) / 2);
    ASSERT_EQ(row_start(i, n), start);
    expect_row_pair(start, n, i, i + 1);
    expect_row_pair(start + (n - 1 - i) - 1, n, i, n - 1);
    if (HasFatalFailure()) return;
  }
  const auto all = static_cast<std::uint64_t>((static_cast<unsigned __int128>(n) * (n - 1)) / 2);
  EXPECT_EQ(pair_count(n), all);
  EXPECT_EQ(row_start(n - 1, n), all);
  expect_row_pair(all - 1, n, n - 2, n - 1);
}

TEST_P(HardCount, FirstAndLastOfColumns) {
  const std::uint64_t n = GetParam();
  for (const std::uint64_t row : rows_to_test(n)) {
    const std::uint64_t j = row + 1;
    const auto start =
        static_cast<std::uint64_t>((static_cast<unsigned __int128>(j) * (j - 1)) / 2);
    for (const std::uint64_t i : {std::uint64_t{0}, j - 1}) {
      const Pair want{static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)};
      ASSERT_TRUE(pair_of_column_index(start + i) == want) << "i " << i << " j " << j;
      ASSERT_EQ(column_index(want.first, want.second), start + i);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(PairIndex, HardCount, testing::ValuesIn(hard_counts));

TEST(PairIndex, CountsThroughWholeTriangles) {
  for (std::uint32_t n = 2; n <= 300; ++n) {
    std::uint64_t row_k = 0, column_k = 0;
    for (std::uint32_t i = 0; i < n; ++i)
      for (std::uint32_t j = i + 1; j < n; ++j) expect_row_pair(row_k++, n, i, j);
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < j; ++i, ++column_k) {
        ASSERT_TRUE((pair_of_column_index(column_k) == Pair{i, j}));
        ASSERT_EQ(column_index(i, j), column_k);
      }
    }
    ASSERT_EQ(row_k, pair_count(n));
    ASSERT_EQ(column_k, pair_count(n));
  }
}

TEST(PairIndex, LargestIndices) {
  // The last columns below k = 2^63, where 8k + 1 would not fit in 64 bits.
  for (std::uint64_t j = 4294967295u; j > 4294967295u - 1000; --j) {
    EXPECT_EQ(triangle_column(pair_count(j)), j);
    EXPECT_EQ(triangle_column(pair_count(j) - 1), j - 1);
    EXPECT_EQ(triangle_column(pair_count(j + 1) - 1), j);
  }
  EXPECT_EQ(triangle_column((std::uint64_t{1} << 63) - 1), 4294967296u);
}

// Rounding to nearest, the root never errs downward; rounding down, it does; rounding up, it errs
// upward far more often.
TEST(PairIndex, AnyRoundingMode) {
  for (const int mode : {FE_DOWNWARD, FE_UPWARD, FE_TOWARDZERO}) {
    std::fesetround(mode);
    std::uint64_t wrong = 0;
    for (std::uint64_t j = 1; j < 4294967295u; j += j < 100000 ? 1 : j / 10007) {
      const volatile std::uint64_t first = pair_count(j);
      wrong += triangle_column(first) != j;
      wrong += triangle_column(first + j - 1) != j;
    }
    std::fesetround(FE_TONEAREST);
    EXPECT_EQ(wrong, 0u) << "mode " << mode;
  }
}

TEST(PairIndex, CompileTimeRootAgrees) {
  constexpr std::uint64_t ks[] = {0,
                                  1,
                                  2,
                                  3,
                                  5,
                                  6,
                                  4095,
                                  4096,
                                  117440511u,
                                  6896136929411071u,
                                  6896136929411072u,
                                  9223372034707292159u};
  constexpr std::uint64_t js[] = {
      triangle_column(ks[0]), triangle_column(ks[1]),  triangle_column(ks[2]),
      triangle_column(ks[3]), triangle_column(ks[4]),  triangle_column(ks[5]),
      triangle_column(ks[6]), triangle_column(ks[7]),  triangle_column(ks[8]),
      triangle_column(ks[9]), triangle_column(ks[10]), triangle_column(ks[11])};
  for (std::size_t q = 0; q < std::size(ks); ++q) EXPECT_EQ(triangle_column(ks[q]), js[q]);
}

TEST(TileFold, IsABijection) {
  for (std::uint32_t tiles = 0; tiles <= 400; ++tiles) {
    const TileFold fold{tiles};
    std::vector<int> seen(std::size_t{tiles} * tiles, 0);
    ASSERT_EQ(std::uint64_t{fold.width()} * fold.height(), pair_count(tiles) + tiles);
    for (std::uint32_t r = 0; r < fold.height(); ++r) {
      for (std::uint32_t c = 0; c < fold.width(); ++c) {
        const TileFold::Cell tile = fold.tile({r, c});
        ASSERT_LE(tile.row, tile.column);
        ASSERT_LT(tile.column, tiles);
        ASSERT_EQ(seen[std::size_t{tile.row} * tiles + tile.column]++, 0);
        ASSERT_TRUE((fold.cell(tile) == TileFold::Cell{r, c}));
      }
    }
  }
}

TEST(TileFold, HoldsForTheLargestCounts) {
  for (const std::uint32_t tiles : {4294967293u, 4294967294u}) {
    const TileFold fold{tiles};
    const std::uint32_t rows[] = {0, 1, tiles / 2 - 1, tiles / 2, tiles / 2 + 1, tiles - 1};
    for (const std::uint32_t row : rows) {
      for (const std::uint32_t column : {row, tiles - 1}) {
        const TileFold::Cell at = fold.cell({row, column});
        EXPECT_LT(at.row, fold.height());
        EXPECT_LT(at.column, fold.width());
        EXPECT_TRUE((fold.tile(at) == TileFold::Cell{row, column}));
      }
    }
  }
}

}  // namespace
}  // namespace throng::base
