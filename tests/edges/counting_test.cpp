// Counts around 2^24, 2^31 and 2^32 pairs without storing any; indices above 2^24, which floats
// cannot represent.
#include <atomic>

#include <throng/throng.hpp>

#include "support/configs.hpp"

namespace throng::tests {
namespace {

constexpr Box unit{{0, 0, 0}, {1, 1, 1}};

struct CountConfig {
  const char* name;
  Backend backend;
  Algorithm algorithm;
};
constexpr CountConfig configs[] = {{"grid", Backend::cpu, Algorithm::grid},
                                   {"all_pairs", Backend::cpu, Algorithm::all_pairs},
                                   {"emulated", Backend::emulated, Algorithm::grid}};

Options options_of(const CountConfig& config) {
  Options o;
  o.backend = config.backend;
  o.algorithm = config.algorithm;
  return o;
}

// One box in one place, `a` times and `b` times: all overlap. b 0: one set.
void expect_count(const CountConfig& config, std::uint64_t a, std::uint64_t b) {
  const std::uint64_t right = b ? a * b : a * (a - 1) / 2;
  const Boxes first(&unit, a, 0), second(&unit, b, 0);
  Finder finder(options_of(config));
  const Result r = b ? finder.find(first, second, nullptr, 0) : finder.find(first, nullptr, 0);
  EXPECT_EQ(r.status, Status::buffer_too_small) << config.name << ": " << r.message;
  EXPECT_EQ(r.found, right) << config.name << ", " << a << " and " << b;
  EXPECT_EQ(r.written, 0u);
  EXPECT_GE(r.comparisons, right);
  EXPECT_NE(std::string(r.message).find(std::to_string(right)), std::string::npos) << r.message;
  EXPECT_LT(finder.memory_bytes(), std::size_t{100} << 20);
}

TEST(PairCounts, Around2To24) {
  for (const CountConfig& config : configs) {
    expect_count(config, 4096, 4096);
    expect_count(config, 4095, 4097);  // one less: the first that is not a float
    expect_count(config, 257, 65537);
    expect_count(config, 5793, 0);  // 16,776,528
    expect_count(config, 5794, 0);
  }
}

TEST(PairCounts, Around2To31) {
  expect_count(configs[0], 65536, 32768);
  expect_count(configs[1], 65537, 32769);
  expect_count(configs[0], 65536, 0);  // 2^31 - 2^15
  expect_count(configs[2], 46341, 46341);
}

TEST(PairCounts, Around2To32) {
  expect_count(configs[0], 65536, 65536);
  expect_count(configs[1], 65535, 65537);
  expect_count(configs[0], 92683, 0);  // 4,295,022,903
  expect_count(configs[1], 92682, 0);  // 4,294,930,221
}

// The consumer's counts, in blocks.
TEST(PairCounts, ConsumedBeyond2To32) {
  Options options;
  options.concurrent_consumer = true;
  Finder finder(options);
  std::atomic<std::uint64_t> taken{0};
  const auto take = [&](const Pair*, std::size_t count) {
    taken += count;
    return true;
  };
  const Result r = finder.consume(Boxes(&unit, 65536, 0), Boxes(&unit, 65537, 0), take);
  EXPECT_TRUE(r.ok());
  EXPECT_EQ(r.found, 65536ull * 65537);
  EXPECT_EQ(r.written, r.found);
  EXPECT_EQ(taken, r.found);
}

// Only some of more than 2^24 boxes are active; their indices do not fit a float.
TEST(Indices, Beyond2To24) {
  constexpr std::uint32_t edge = 1u << 24;
  std::vector<Box> boxes(edge + 12, Box{{1, 1, 1}, {0, 0, 0}});
  const std::uint32_t there[] = {0, 1, edge - 2, edge - 1, edge, edge + 1, edge + 3, edge + 11};
  std::vector<Pair> right;
  for (std::size_t i = 0; i < std::size(there); ++i) {
    boxes[there[i]] = {{static_cast<float>(i), 0, 0}, {static_cast<float>(i) + 1, 1, 1}};
    if (i > 0) right.push_back({there[i - 1], there[i]});  // each touches the next
  }
  for (const CountConfig& config : {configs[0], configs[2]}) {
    Options options = options_of(config);
    options.order = Order::canonical;
    Finder finder(options);
    const Result r = finder.find(boxes);
    EXPECT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.inactive, boxes.size() - std::size(there));
    EXPECT_EQ(to_vector(finder.pairs()), right) << config.name;
    const Result two = finder.find(Boxes(&boxes[0], 2), boxes);
    EXPECT_TRUE(two.ok());
    EXPECT_EQ(to_vector(finder.pairs()),
              (std::vector<Pair>{{0, 0}, {0, 1}, {1, 0}, {1, 1}, {1, edge - 2}}))
        << config.name;
  }
}

}  // namespace
}  // namespace throng::tests
