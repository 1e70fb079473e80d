// The consumer form: blocks, stopping, exceptions, the memory cap, order.
#include <atomic>
#include <cmath>
#include <memory_resource>
#include <mutex>
#include <stdexcept>

#if defined(THRONG_TESTS_TBB)
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

#include "support/configs.hpp"
#include "support/counting_resource.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Consume : public Conformance {
 protected:
  // A hundred times slower, so it gets smaller scenes.
  bool emulated() const { return config().backend == Backend::emulated; }
};

// Collects blocks and detects concurrent calls.
struct Collector {
  std::vector<Pair> pairs;
  std::atomic<int> inside{0};
  bool overlapped = false, empty_block = false;
  std::size_t blocks = 0;

  bool operator()(const Pair* block, std::size_t count) {
    if (inside.fetch_add(1) != 0) overlapped = true;
    if (count == 0 || block == nullptr) empty_block = true;
    pairs.insert(pairs.end(), block, block + count);
    ++blocks;
    inside.fetch_sub(1);
    return true;
  }
};

void expect_collected(const Result& result, const Collector& taken, const Config& config,
                      const Answer& answer) {
  EXPECT_FALSE(taken.overlapped) << "two calls at once";
  EXPECT_FALSE(taken.empty_block);
  expect_pairs(result, config, answer, taken.pairs, 0);
}

std::size_t passed_to_function = 0;
bool count_passed(const Pair*, std::size_t count) {
  passed_to_function += count;
  return true;
}

TEST_P(Consume, AFunctionByItsName) {
  Finder finder(options());
  passed_to_function = 0;
  const Result result = finder.consume(identical_boxes(50, 2), count_passed);
  ASSERT_TRUE(result.ok()) << result.message;
  EXPECT_EQ(passed_to_function, 50u * 49 / 2);
}

TEST_P(Consume, BlocksMakeUpThePairs) {
  static std::vector<Answer> answers;  // shared by all configurations
  std::size_t next = 0;
  for (const BoxList& boxes : {uniform_boxes(6000, 1), identical_boxes(500, 2),
                               snapped_boxes(1000, 9, 1, 3), infinite_bounds(700, 4), BoxList{}}) {
    if (answers.size() == next) answers.push_back(reference_pairs(boxes));
    const Answer& answer = answers[next++];
    Finder finder(options());
    Collector taken;
    expect_collected(finder.consume(boxes, taken), taken, config(), answer);
  }
  const BoxList a = uniform_boxes(1100, 1), b = uniform_boxes(900, 2);
  Finder finder(options());
  Collector taken;
  expect_collected(finder.consume(a, b, taken), taken, config(), reference_pairs(a, b));
}

TEST_P(Consume, FiltersAndEmptySlots) {
  const BoxList boxes = with_inverted(1500, 2);
  std::vector<std::int32_t> worlds;
  for (std::size_t i = 0; i < boxes.size(); ++i) worlds.push_back(static_cast<int>(i % 4) - 1);
  Boxes view = boxes;
  view.filters.world = {worlds.data(), worlds.size()};
  Finder finder(options());
  Collector taken;
  expect_collected(finder.consume(view, taken), taken, config(), reference_pairs(view));
}

TEST_P(Consume, FalseStops) {
  const BoxList boxes = identical_boxes(700, 1);
  for (const std::size_t blocks_wanted : {1u, 2u}) {
    Finder finder(options());
    std::size_t taken = 0, calls = 0;
    const auto take = [&](const Pair*, std::size_t count) {
      taken += count;
      return ++calls < blocks_wanted;
    };
    const Result result = finder.consume(boxes, take);
    if (result.ok()) {  // all in fewer blocks than that
      EXPECT_LT(calls, blocks_wanted);
      continue;
    }
    EXPECT_EQ(result.status, Status::stopped);
    EXPECT_EQ(calls, blocks_wanted) << "called again after it returned false";
    EXPECT_EQ(result.written, taken);
    EXPECT_TRUE(finder.find(boxes).ok());
    EXPECT_EQ(finder.pairs().size(), 700u * 699u / 2);
  }
}

TEST_P(Consume, ExceptionsPropagate) {
  struct Special {
    int value;
  };
  const BoxList boxes = identical_boxes(500, 1);
  Finder finder(options());
  std::atomic<int> calls{0};
  const auto thrower = [&](const Pair*, std::size_t) -> bool {
    ++calls;
    throw Special{4711};
  };
  try {
    (void)finder.consume(boxes, thrower);
    FAIL() << "the exception did not propagate";
  } catch (const Special& special) {
    EXPECT_EQ(special.value, 4711);
  }
  EXPECT_EQ(calls, 1) << "called again after it threw";
  Collector taken;
  expect_collected(finder.consume(boxes, taken), taken, config(), reference_pairs(boxes));
}

TEST_P(Consume, ConcurrentIfRequested) {
  const BoxList boxes = uniform_boxes(8000, 9);
  static const Answer answer = reference_pairs(boxes);
  Options with = options();
  with.concurrent_consumer = true;
  Finder finder(with);
  std::mutex mutex;
  std::vector<Pair> pairs;
  const auto take = [&](const Pair* block, std::size_t count) {
    const std::lock_guard<std::mutex> lock(mutex);
    pairs.insert(pairs.end(), block, block + count);
    return true;
  };
  const Result result = finder.consume(boxes, take);
  expect_pairs(result, config(), answer, pairs, boxes.size());
}

// The cap covers all memory that the library takes; below the minimum the error names the bytes
// needed, and exactly these are enough.
TEST_P(Consume, MemoryCap) {
  for (const BoxList& boxes :
       {uniform_boxes(2500, 1), identical_boxes(emulated() ? 300 : 600, 2)}) {
    const Answer answer = reference_pairs(boxes);
    for (const std::size_t cap : {std::size_t{1}, std::size_t{1000}}) {
      Options with = options();
      with.memory_cap_bytes = cap;
      CountingResource memory;
      with.memory = &memory;
      std::uint64_t needed = 0;
      {
        Finder finder(with);
        Collector taken;
        const Result result = finder.consume(boxes, taken);
        if (result.ok()) {
          expect_collected(result, taken, config(), answer);
          EXPECT_LE(memory.peak(), cap);
          continue;
        }
        EXPECT_EQ(result.status, Status::memory_cap_too_small);
        EXPECT_GT(result.bytes_needed, cap);
        EXPECT_NE(std::string(result.message).find(std::to_string(result.bytes_needed)),
                  std::string::npos)
            << result.message;
        EXPECT_TRUE(taken.pairs.empty());
        EXPECT_LE(memory.peak(), cap);
        needed = result.bytes_needed;
      }
      if (config().backend != Backend::cpu) {  // the estimate is less close
        with.memory_cap_bytes = static_cast<std::size_t>(needed - 1);
        CountingResource counted;
        with.memory = &counted;
        Finder finder(with);
        Collector taken;
        const Result result = finder.consume(boxes, taken);
        EXPECT_EQ(result.status, Status::memory_cap_too_small)
            << "one byte less than the reported need";
        EXPECT_EQ(result.bytes_needed, needed);
        EXPECT_LE(counted.peak(), needed - 1);
      }
      for (const std::uint64_t enough : {needed, needed + needed / 7, 16 * needed}) {
        SCOPED_TRACE("a cap of " + std::to_string(enough) + " bytes");
        with.memory_cap_bytes = enough;
        CountingResource counted;
        with.memory = &counted;
        Finder finder(with);
        Collector taken;
        expect_collected(finder.consume(boxes, taken), taken, config(), answer);
        EXPECT_LE(counted.peak(), enough) << "allocated more than the cap allows";
        EXPECT_LE(finder.memory_bytes(), enough) << "more held, a device's memory included";
      }
    }
  }
}

// Retries with the bytes that the Finder names until it succeeds; returns their number, at most
// ten.
int refusals(Finder& finder, Options with, const Boxes& a, const Boxes* b) {
  for (int calls = 0; calls < 10; ++calls) {
    finder.set_options(with);
    const auto take = [](const Pair*, std::size_t) { return true; };
    const Result r = b ? finder.consume(a, *b, take) : finder.consume(a, take);
    if (r.ok()) return calls;
    EXPECT_EQ(r.status, Status::memory_cap_too_small);
    EXPECT_GT(r.bytes_needed, with.memory_cap_bytes);
    with.memory_cap_bytes = static_cast<std::size_t>(r.bytes_needed);
  }
  return 10;
}

// A Finder releases memory kept from other searches before it fails.
TEST_P(Consume, MemoryOfOtherSearchesDoesNotCount) {
  const BoxList boxes = uniform_boxes(900, 4), other = uniform_boxes(2500, 5);
  Options with = options();
  with.memory_cap_bytes = 1000;
  Finder fresh(with), warm(options());
  const auto take = [](const Pair*, std::size_t) { return true; };
  ASSERT_TRUE(warm.consume(other, take).ok());
  ASSERT_TRUE(warm.find(other).ok());
  EXPECT_LE(refusals(warm, with, boxes, nullptr), refusals(fresh, with, boxes, nullptr));
}

// Boxes with sizes and positions of all exponents, which a sample represents poorly.
TEST_P(Consume, RetriesTerminate) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Random random(seed);
    const auto some = [&] {
      BoxList boxes(900);
      for (Box& b : boxes)
        for (int k = 0; k < 3; ++k) {
          const float x = std::ldexp(static_cast<float>(1 + random.below(7)),
                                     static_cast<int>(random.below(250)) - 126) *
                          (random.one_in(2) ? -1.0f : 1.0f);
          (&b.lower.x)[k] = x;
          (&b.upper.x)[k] = random.one_in(2) ? x : x + std::fabs(x) * random.unit();
        }
      return boxes;
    };
    const BoxList a = some(), b = some();
    const Boxes second = b;
    Options with = options();
    with.memory_cap_bytes = 1000;
    Finder finder(with);
    EXPECT_LE(refusals(finder, with, a, seed % 2 ? &second : nullptr), 3) << seed;
  }
}

// Far more pairs than fit under the cap: they are delivered in blocks, sorted if requested.
TEST_P(Consume, MorePairsThanMemory) {
  const std::uint32_t n = emulated() ? 600 : 1100;
  const BoxList boxes = identical_boxes(n, 3);
  const std::uint64_t count = n * (n - 1) / 2, bytes = count * sizeof(Pair);
  Options with = options();
  with.memory_cap_bytes = 1;
  CountingResource memory;
  with.memory = &memory;
  const auto none = [](const Pair*, std::size_t) { return true; };
  const std::uint64_t needed = Finder(with).consume(boxes, none).bytes_needed;
  EXPECT_LT(needed, bytes / 2) << "the minimum grows with the pairs";
  with.memory_cap_bytes = needed;
  CountingResource counted;
  with.memory = &counted;
  Finder finder(with);
  Pair last{0, 0};
  std::uint64_t taken = 0, sum = 0, unordered = 0;
  const auto take = [&](const Pair* pairs, std::size_t block) {
    for (std::size_t i = 0; i < block; ++i) {
      unordered += taken + i > 0 && !(last < pairs[i]);
      last = pairs[i];
      sum += std::uint64_t{pairs[i].first} * n + pairs[i].second;
    }
    taken += block;
    return true;
  };
  const Result result = finder.consume(boxes, take);
  EXPECT_TRUE(result.ok()) << result.message;
  EXPECT_EQ(taken, count);
  std::uint64_t want = 0;
  for (std::uint64_t i = 0; i < n; ++i)
    for (std::uint64_t j = i + 1; j < n; ++j) want += i * n + j;
  EXPECT_EQ(sum, want);
  if (config().order == Order::canonical) {
    EXPECT_EQ(unordered, 0u);
  }
  EXPECT_LE(counted.peak(), needed);
}

// Under a cap that is just enough sorted pairs come in few blocks, as each block takes another
// search: they get the memory that the search leaves unused.
TEST(ConsumeUnderACap, SortedPairsComeInFewBlocks) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  BoxList boxes = uniform_boxes(20'000, 4);
  for (Box& box : boxes) box.upper = {box.lower.x + 3, box.lower.y + 3, box.lower.z + 3};
  const Answer answer = reference_pairs(boxes);
  for (const unsigned threads : {1u, 2u}) {
    Options options;
    options.threads = threads;
    options.order = Order::canonical;
    options.memory_cap_bytes = 1;
    const auto none = [](const Pair*, std::size_t) { return true; };
    options.memory_cap_bytes =
        static_cast<std::size_t>(Finder(options).consume(boxes, none).bytes_needed);
    CountingResource counted;
    options.memory = &counted;
    Finder finder(options);
    std::vector<Pair> taken;
    int blocks = 0;
    const Result r = finder.consume(boxes, [&](const Pair* pairs, std::size_t count) {
      taken.insert(taken.end(), pairs, pairs + count);
      ++blocks;
      return true;
    });
    EXPECT_TRUE(r.ok()) << r.message;
    EXPECT_TRUE(std::equal(taken.begin(), taken.end(), answer.pairs.begin(), answer.pairs.end()));
    EXPECT_GT(answer.pairs.size(), 40 * 4096u);
    EXPECT_LE(blocks, 12) << threads;
    EXPECT_LE(counted.peak(), options.memory_cap_bytes);
  }
}

// The result counts the pairs that a consumer received before memory ran out.
TEST(ConsumeUnderACap, CountsDeliveredPairs) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  // Some columns have many more boxes than others.
  BoxList boxes;
  Random random(7);
  for (int i = 0; i < 60'000; ++i) boxes.push_back(cube(random.point(0, 1), 0.03f));
  for (int i = 0; i < 40'000; ++i) boxes.push_back(cube(random.point(0.95f, 1), 0.001f));
  std::size_t partial = 0;
  for (std::size_t cap = 4'000'000; cap < 9'000'000; cap += 100'000) {
    Options options;
    options.threads = 1;
    options.memory_cap_bytes = cap;
    Finder finder(options);
    std::uint64_t handed = 0;
    const Result r = finder.consume(boxes, [&](const Pair*, std::size_t count) {
      handed += count;
      return true;
    });
    EXPECT_EQ(r.written, handed) << "cap " << cap;
    EXPECT_EQ(r.found, r.ok() ? handed : 0) << "cap " << cap;
    partial += !r.ok() && handed != 0;
  }
  EXPECT_GT(partial, 0u) << "never partially";
}

TEST_P(Consume, InvalidInputReachesNoConsumer) {
  BoxList boxes = identical_boxes(50, 1);
  boxes[20].lower.x = std::numeric_limits<float>::quiet_NaN();
  Finder finder(options());
  Collector taken;
  const Result result = finder.consume(boxes, taken);
  EXPECT_EQ(result.status, Status::nan_box);
  EXPECT_EQ(result.first_invalid, 20u);
  EXPECT_EQ(taken.blocks, 0u);
}

THRONG_INSTANTIATE(Consume, suite_configs);

#if defined(THRONG_TESTS_TBB)
// A consumer that waits for its own tasks, on the threads that also search: it must not be given
// tasks of the outer search, which would wait for the consumer.
TEST(ConsumeOnTheSameThreads, TasksAndSearchesOfItsOwn) {
  const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism, 4);
  tbb::task_arena arena(4);
  const BoxList boxes = uniform_boxes(20'000, 5), others = uniform_boxes(7'000, 6);
  const std::size_t wanted = reference_pairs(others).pairs.size();
  for (const bool concurrent : {false, true}) {
    Options options;
    options.threads = 4;
    options.concurrent_consumer = concurrent;
    std::atomic<std::size_t> pairs{0};
    std::atomic<bool> wrong{false};
    std::uint64_t found = 0;
    arena.execute([&] {
      Finder finder(options);
      for (int k = 0; k < 40; ++k) {
        const Result r = finder.consume(boxes, [&](const Pair*, std::size_t count) {
          tbb::parallel_for(std::size_t{0}, count, [&](std::size_t) { ++pairs; });
          if (k % 4 != 0) return true;
          std::vector<Pair> own;
          Options inner;
          inner.threads = 4;
          if (!find_pairs(others, own, inner).ok() || own.size() != wanted) wrong = true;
          return true;
        });
        found += r.found;
      }
    });
    EXPECT_GT(found, 0u);
    EXPECT_EQ(pairs, found);
    EXPECT_FALSE(wrong);
  }
}
#endif

}  // namespace
}  // namespace throng::tests
