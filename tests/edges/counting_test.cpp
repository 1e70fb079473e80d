// Counts around 2^24, 2^31 and 2^32 pairs without storing any; indices above 2^24, which floats
// cannot represent; and the stack use of a search.
#include <pthread.h>

#include <cstring>

#include <throng/checksum.hpp>
#include <throng/throng.hpp>

#include "support/configs.hpp"
#include "support/in_turn.hpp"

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

// Runs on a thread with a painted stack; bytes that changed were used.
std::size_t stack_of(void* (*start)(void*), void* argument) {
  static constexpr std::size_t bytes = std::size_t{1} << 20;
  void* stack = nullptr;
  if (posix_memalign(&stack, 4096, bytes) != 0) return 0;
  std::memset(stack, 0x5a, bytes);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstack(&attributes, stack, bytes);
  pthread_t thread;
  std::size_t unused = 0;
  if (pthread_create(&thread, &attributes, start, argument) == 0) {
    pthread_join(thread, nullptr);
    while (unused < bytes && static_cast<unsigned char*>(stack)[unused] == 0x5a) ++unused;
  }
  pthread_attr_destroy(&attributes);
  std::free(stack);
  return bytes - unused;
}

// Nested grids, sorted order, filters and a persistent BroadPhase, all on one thread that runs
// every task. This is the stack figure of docs/explanation/testing.md.
TEST(Stack, IsSmall) {
  if (sanitized) GTEST_SKIP() << "sanitizers use more stack";
  const auto run = [](void*) -> void* {
    const Executor here = in_turn(4);
    std::vector<Box> boxes;
    for (int i = 0; i < 60000; ++i) {  // a cluster in a corner: its column has a grid of its own
      const float far = i % 50 == 0 ? 1000.0f : 1.0f;
      const auto at = [&](int prime) { return far * static_cast<float>(i % prime) / 97.0f; };
      const Vec3 p{at(1009), at(2003), at(3001)};
      boxes.push_back({p, {p.x + 0.2f, p.y + 0.2f, p.z + 0.2f}});
    }
    std::vector<std::int32_t> world(boxes.size());
    for (std::size_t i = 0; i < world.size(); ++i) world[i] = static_cast<std::int32_t>(i % 3) - 1;
    for (const CountConfig& config : configs) {
      Options options = options_of(config);
      options.executor = &here;
      options.order = Order::canonical;
      Boxes some(boxes.data(), config.algorithm == Algorithm::all_pairs ? 3000 : boxes.size());
      Finder finder(options);
      if (!finder.find(some).ok()) std::abort();
      some.filters.world = {world.data(), some.size()};
      if (!finder.find(some).ok()) std::abort();
      const auto take = [](const Pair*, std::size_t) { return true; };
      if (!finder.consume(some, take).ok()) std::abort();
      options.margin = 0.01f;
      options.backend = Backend::automatic;
      BroadPhase live(options);
      if (!live.add(some, nullptr).ok() || !live.update().ok()) std::abort();
      for (ObjectId id = 0; id < 3; ++id) {
        if (live.move(id, boxes[9]) != Status::ok || !live.update().ok()) std::abort();
      }
      if (!live.find_overlaps(Boxes(boxes.data(), 100)).ok()) std::abort();
    }
    return nullptr;
  };
  const std::size_t used = stack_of(run, nullptr);
  RecordProperty("stack_bytes", static_cast<int>(used));
  EXPECT_GT(used, std::size_t{4096});
  EXPECT_LT(used, std::size_t{160} << 10);
  std::printf("%zu bytes of stack\n", used);
}

}  // namespace
}  // namespace throng::tests
