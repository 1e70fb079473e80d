// From thread to pair: each mapping against the double loop, and where roots begin to fail.
#include "apps/paper/mapping.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "apps/paper/search.hpp"
#include "apps/paper/variant.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

std::vector<Pair> double_loop(std::uint32_t n) {
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = i + 1; j < n; ++j) pairs.push_back({i, j});
  return pairs;
}

template <class Mapping>
std::vector<Pair> all_of(const Mapping& mapping, std::uint64_t n) {
  std::vector<Pair> pairs;
  for (std::uint64_t t = 0; t < Mapping::threads(n); ++t) {
    Pair pair{};
    if (mapping(t, n, pair)) pairs.push_back(pair);
  }
  return pairs;
}

constexpr std::uint32_t counts[] = {0, 1, 2, 3, 4, 5, 31, 32, 33, 64, 100, 257, 1000};

Variant formula(RootKind root, int steps = 2, bool repair = true,
                Radicand radicand = Radicand::integer) {
  Variant variant;
  variant.root = root;
  variant.steps = steps;
  variant.repair = repair;
  variant.radicand = radicand;
  return variant;
}

TEST(Mapping, FormulaNumbersAsTheDoubleLoop) {
  const Variant variants[] = {formula(RootKind::float32, 2, false), formula(RootKind::float32),
                              formula(RootKind::float64, 2, false), formula(RootKind::exact),
                              formula(RootKind::carmack, 2),        formula(RootKind::carmack, 3),
                              formula(RootKind::carmack, 4),        formula(RootKind::lomont, 2),
                              formula(RootKind::lomont, 3),         formula(RootKind::lomont, 4)};
  for (const Variant& variant : variants)
    for (const std::uint32_t n : counts)
      EXPECT_EQ(with_mapping(variant, nullptr, [&](const auto& m) { return all_of(m, n); }),
                double_loop(n))
          << describe(variant) << " n " << n;
}

TEST(Mapping, StoredListIsTheDoubleLoop) {
  for (const std::uint32_t n : counts) {
    std::vector<Pair> list(Stored::threads(n));
    const FillList<Exact> fill{Exact{}, n, list.data()};
    for (std::uint64_t k = 0; k < list.size(); ++k) fill(k);
    EXPECT_EQ(list, double_loop(n));
    EXPECT_EQ(all_of(Stored{list.data()}, n), double_loop(n));
  }
}

// These have another numbering, and reach each pair once.
TEST(Mapping, LazyAndFoldReachEachPairOnce) {
  for (const std::uint32_t n : counts) {
    EXPECT_EQ(Lazy::threads(n), std::uint64_t{n} * n - n);
    EXPECT_EQ(all_of(Lazy{}, n), double_loop(n));
    std::vector<Pair> folded = all_of(Fold{}, n);
    EXPECT_EQ(folded.size(), Fold::threads(n));
    std::sort(folded.begin(), folded.end());
    EXPECT_EQ(folded, double_loop(n)) << n;
  }
}

// A reader of the output decodes position t to the pair that an exact thread t tested.
TEST(Mapping, PositionsDecodeToTheirPairs) {
  for (const MappingKind kind : {MappingKind::formula, MappingKind::lazy, MappingKind::stored,
                                 MappingKind::fold, MappingKind::exact}) {
    Variant variant;
    variant.mapping = kind;
    const std::uint64_t n = 57;
    const std::vector<Pair> list = double_loop(57);
    with_mapping(variant, list.data(), [&](const auto& mapping) {
      ASSERT_EQ(mapping.threads(n), thread_count(variant, n));
      for (std::uint64_t t = 0; t < thread_count(variant, n); ++t) {
        Pair written{}, read{};
        const bool some = mapping(t, n, written);
        ASSERT_EQ(pair_at_position(variant, t, n, read), some);
        if (some) {
          ASSERT_EQ(read, written) << name(kind) << " " << t;
        }
      }
    });
  }
}

// Its two examples, 1-based.
TEST(Mapping, ExamplesOfThePaper) {
  for (const RootKind root : {RootKind::float32, RootKind::float64, RootKind::exact}) {
    with_mapping(formula(root, 2, false), nullptr, [](const auto& mapping) {
      Pair pair{};
      EXPECT_TRUE(mapping(71452, 1000, pair));
      EXPECT_EQ(pair, (Pair{75 - 1, 303 - 1}));
      EXPECT_TRUE(mapping(46108, 1000, pair));
      EXPECT_EQ(pair, (Pair{48 - 1, 285 - 1}));
    });
  }
  EXPECT_EQ(first_index(1, 1000), 0);
  EXPECT_EQ(first_index(2, 1000), 999);
  EXPECT_EQ(first_index(1000, 1000), 499500);   // one past the last pair
  EXPECT_EQ(exact_radicand(499499, 1000), 9u);  // of the last pair, for every n
  EXPECT_EQ(exact_radicand(base::pair_count(max_objects) - 1, max_objects), 9u);
  EXPECT_LT((2 * max_objects - 1) * (2 * max_objects - 1), std::uint64_t{1} << 63);
  EXPECT_GT(static_cast<unsigned __int128>(2 * max_objects + 1) * (2 * max_objects + 1),
            static_cast<unsigned __int128>(1) << 63);
}

// The first n at which a root gives a wrong pair without repairs; checks all smaller n.
TEST(Mapping, FloatFailsFirstAt4098) {
  for (const Radicand radicand : {Radicand::integer, Radicand::real}) {
    const Variant variant = formula(RootKind::float32, 2, false, radicand);
    for (std::uint64_t n = 2; n <= 4097; n += n < 3500 ? 7 : 1)
      ASSERT_EQ(count_errors(variant, n, 1).rows, 0u) << n;
    const MappingErrors errors = count_errors(variant, 4098);
    EXPECT_GT(errors.rows, 0u);
    EXPECT_EQ(errors.first_index, 4096u);
  }
}

// Beyond n = 5793 the largest k is not a float.
TEST(Mapping, RepairsFailForInexactIndices) {
  EXPECT_EQ(count_errors(formula(RootKind::float32, 2, true, Radicand::real), 5793, 1).rows, 0u);
  const Variant variant = formula(RootKind::float32, 2, true, Radicand::real);
  std::uint64_t failing = 0;
  for (std::uint64_t n = 5794; n < 5900; ++n) failing += count_errors(variant, n, 1).rows > 0;
  EXPECT_GT(failing, 0u);
}

// Double's first failures are at the end of row 1; for smaller n rows are sampled: each row takes 2
// s.
template <class Mapping>
bool row_ends_match(const Mapping& mapping, std::uint64_t n, std::uint64_t i) {
  const std::uint32_t row = static_cast<std::uint32_t>(i);
  Pair first{}, last{};
  return mapping(base::row_start(i, n), n, first) && first == Pair{row, row + 1} &&
         mapping(base::row_start(i + 1, n) - 1, n, last) &&
         last == Pair{row, static_cast<std::uint32_t>(n - 1)};
}

void fails_first_at(Radicand radicand, std::uint64_t n) {
  const Formula<HardwareRoot<double>> mapping{{}, false, radicand};
  for (std::uint64_t i = 0; i < n - 2; i += i < 300000 ? 1 : 997)
    ASSERT_TRUE(row_ends_match(mapping, n - 1, i)) << "n " << n - 1 << " row " << i;
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < 300000; ++i) wrong += !row_ends_match(mapping, n, i);
  EXPECT_GT(wrong, 0u) << n;
}

TEST(Mapping, DoubleFailsFirstAt117440514) {
  fails_first_at(Radicand::integer, 117440514);
  Pair pair{};
  const Formula<HardwareRoot<double>> mapping{{}, false, Radicand::integer};
  EXPECT_FALSE(mapping(117440512, 117440514, pair) && pair == (Pair{0, 117440513}));
  EXPECT_TRUE(Exact{}(117440512, 117440514, pair));
  EXPECT_EQ(pair, (Pair{0, 117440513}));
}

TEST(Mapping, AllDoubleFailsFirstAt94906267) { fails_first_at(Radicand::real, 94906267); }

// A wrong row never names an object that does not exist.
TEST(Mapping, NoPairOutOfRange) {
  for (const RootKind root : {RootKind::carmack, RootKind::lomont, RootKind::float32})
    for (const bool repair : {false, true})
      for (const Radicand radicand : {Radicand::integer, Radicand::real})
        for (const std::uint64_t n : {2u, 3u, 100u, 7001u, 90000u}) {
          const Variant variant = formula(root, 1, repair, radicand);
          with_mapping(variant, nullptr, [&](const auto& mapping) {
            const std::uint64_t all = base::pair_count(n), step = all / 99991 + 1;
            for (std::uint64_t k = 0; k < all; k += step) {
              Pair pair{};
              if (mapping(k, n, pair)) {
                ASSERT_TRUE(pair.first < pair.second && pair.second < n)
                    << describe(variant) << " n " << n << " k " << k;
              }
            }
          });
        }
}

// In float the radicand of the last indices is negative; the row is still valid, without NaN.
TEST(Mapping, NegativeRadicandIsClamped) {
  const Formula<HardwareRoot<float>> mapping{{}, false, Radicand::real};
  for (const std::uint64_t n : {7001u, 90000u, 1000003u}) {
    const std::uint64_t all = base::pair_count(n);
    for (std::uint64_t k = all - 5000; k < all; ++k) {
      const std::int64_t row = mapping.row(k, n);
      ASSERT_TRUE(row > 0 && row <= static_cast<std::int64_t>(n) + 1) << "n " << n << " k " << k;
    }
  }
}

}  // namespace
}  // namespace throng::paper
