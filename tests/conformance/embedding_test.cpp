// Embedding: a given executor is the only source of threads, a given memory resource the only
// source of memory, and a warmed Finder allocates nothing for the next scene.
#include <atomic>
#include <cstdlib>
#include <set>
#include <thread>

#include "support/configs.hpp"
#include "support/counting_resource.hpp"
#include "support/hard_boxes.hpp"
#include "support/heap_count.hpp"
#include "support/thread_count.hpp"

namespace throng::tests {
namespace {

// Runs every task on the caller, the last first: no task may wait for another.
struct InlineExecutor {
  std::set<std::thread::id> threads;
  std::size_t most_threads = 0;
  unsigned most_tasks = 0;

  Executor view(unsigned concurrency) {
    Executor e;
    e.concurrency = concurrency;
    e.self = this;
    e.run = [](void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
      auto& me = *static_cast<InlineExecutor*>(self);
      const bool counting = HeapCount::pause();  // this work is not the library's
      me.threads.insert(std::this_thread::get_id());
      me.most_threads = std::max(me.most_threads, thread_count());
      me.most_tasks = std::max(me.most_tasks, count);
      HeapCount::resume(counting);
      for (unsigned i = count; i-- > 0;) task(context, i);
    };
    return e;
  }
};

// A resource whose own allocator calls are not counted as the library's.
class HiddenResource : public CountingResource {
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    const bool counting = HeapCount::pause();
    void* memory = CountingResource::do_allocate(bytes, alignment);
    HeapCount::resume(counting);
    return memory;
  }
};

struct EmbeddingScene {
  BoxList boxes;
  Answer answer;
};

const std::vector<EmbeddingScene>& embedding_scenes() {
  static const std::vector<EmbeddingScene> scenes = [] {
    std::vector<EmbeddingScene> all;
    for (BoxList& boxes : std::vector<BoxList>{
             uniform_boxes(20000, 1), uniform_boxes(700, 1), huge_among_small(9000, 2),
             identical_boxes(300, 3), clusters_and_outliers(8000, 4), infinite_bounds(1200, 5)}) {
      Answer answer = swept_pairs(boxes);
      all.push_back({std::move(boxes), std::move(answer)});
    }
    return all;
  }();
  return scenes;
}

class Embedding : public Conformance {
 protected:
  // Options of an embedded call: the caller's thread, and the caller's memory if given.
  Options embedding_options(std::pmr::memory_resource* memory = nullptr) const {
    Options with = options();
    with.executor = &executor_;
    if (memory) with.memory = memory;
    return with;
  }

 private:
  InlineExecutor inline_executor_;
  const Executor executor_ = inline_executor_.view(3);
};

std::vector<Config> embedding_configs() {
  std::vector<Config> configs;
  for (const Config& config : all_configs())
    if (config.isa == Isa::automatic ||
        (config.backend == Backend::emulated && config.algorithm == Algorithm::grid) ||
        (config.backend == Backend::cpu &&
         ((config.isa == supported_isas().back() && config.threads <= 3) ||
          (config.isa == Isa::scalar && config.threads == 3 &&
           config.algorithm == Algorithm::grid))))
      configs.push_back(config);
  return configs;
}

// Named to run first, while the process has one thread.
TEST_P(Embedding, AGivenExecutorStartsNoThread) {
  const std::size_t before = thread_count();
  for (const auto& [boxes, answer] : embedding_scenes()) {
    InlineExecutor inline_executor;
    const Executor executor = inline_executor.view(4);
    Options with = options();
    with.executor = &executor;
    Finder finder(with);
    const Result result = finder.find(boxes);
    expect_pairs(result, config(), answer, to_vector(finder.pairs()), boxes.size());
    std::vector<Pair> taken;
    const auto take = [&](const Pair* pairs, std::size_t count) {
      taken.insert(taken.end(), pairs, pairs + count);
      return true;
    };
    const Result consumed = finder.consume(boxes, take);
    expect_pairs(consumed, config(), answer, taken, 0);
    for (const std::thread::id id : inline_executor.threads)
      EXPECT_EQ(id, std::this_thread::get_id());
    if (before != 0) {
      EXPECT_LE(inline_executor.most_threads, before) << "a thread was started";
    }
    if (config().threads >= 2 && boxes.size() >= 20000) {
      EXPECT_GT(inline_executor.most_tasks, 1u) << "the executor was not used";
    }
    if (config().threads != 0) {
      EXPECT_LE(inline_executor.most_tasks, std::max(4u, config().threads));
    }
  }
  EXPECT_EQ(thread_count(), before);
}

// One thread requested: none is started, with the default executor either.
TEST_P(Embedding, BOneThreadIsTheCaller) {
  if (config().threads != 1) GTEST_SKIP() << "several threads are requested";
  const std::size_t before = thread_count();
  expect_exact(embedding_scenes()[0].boxes, config(), embedding_scenes()[0].answer);
  EXPECT_EQ(thread_count(), before);
}

// Executors that start a thread per task, or run tasks in unusual orders, give the same pairs.
TEST_P(Embedding, AnyExecutor) {
  Executor threads;
  threads.concurrency = 3;
  threads.run = [](void*, unsigned count, void (*task)(void*, unsigned), void* context) {
    std::vector<std::thread> running;
    for (unsigned i = 0; i < count; ++i) running.emplace_back(task, context, i);
    for (std::thread& thread : running) thread.join();
  };
  for (const auto& [boxes, answer] : embedding_scenes()) {
    Options with = options();
    with.executor = &threads;
    Finder finder(with);
    const Result result = finder.find(boxes);
    expect_pairs(result, config(), answer, to_vector(finder.pairs()), boxes.size());
  }
}

// If one task does all of the work, and the others hold blocks of the output, that space is used:
// with capacity for exactly the pairs, and for one less.
TEST_P(Embedding, FillsOutputForAnySchedule) {
  InlineExecutor inline_executor;
  const Executor executor = inline_executor.view(4);
  Options with = options();
  with.executor = &executor;
  for (const auto& [boxes, answer] : embedding_scenes()) {
    const auto found = static_cast<std::size_t>(answer.pairs.size());
    Finder finder(with);
    for (const std::size_t capacity : {4 * found + 100000, found, found == 0 ? 0 : found - 1}) {
      std::vector<Pair> out(capacity);
      const Result result = finder.find(boxes, out.data(), capacity);
      ASSERT_EQ(result.found, found);
      const bool fits = found <= capacity;
      EXPECT_EQ(result.status, fits ? Status::ok : Status::buffer_too_small);
      EXPECT_EQ(result.written, fits || with.order == Order::any ? std::min(found, capacity) : 0u);
      if (fits) {
        out.resize(found);
        EXPECT_TRUE(same_pairs(out, answer.pairs)) << found << " pairs, capacity " << capacity;
      }
    }
  }
}

TEST_P(Embedding, AllBytesComeFromTheResource) {
  for (const auto& [boxes, answer] : embedding_scenes()) {
    HiddenResource memory;
    {
      const Options with = embedding_options(&memory);
      Finder finder(with);
      HeapCount::start();
      const Result result = finder.find(boxes);
      const std::size_t beside = HeapCount::stop();
      EXPECT_EQ(beside, 0u) << "allocations outside the memory resource";
      EXPECT_GT(memory.allocations(), 0u);
      expect_pairs(result, config(), answer, to_vector(finder.pairs()), boxes.size());
      EXPECT_EQ(finder.memory_bytes(), memory.held());
    }
    EXPECT_EQ(memory.held(), 0u) << "not released";
  }
}

TEST_P(Embedding, AWarmFinderAllocatesNothing) {
  for (const auto& [boxes, answer] : embedding_scenes()) {
    const Options with = embedding_options();
    Finder finder(with);
    std::vector<Pair> buffer(answer.pairs.size());
    const auto none = [](const Pair*, std::size_t) { return true; };
    const Boxes half(boxes.data(), boxes.size() / 2);
    for (int warming = 0; warming < 2; ++warming) {
      (void)finder.find(boxes);
      (void)finder.find(boxes, half);
      (void)finder.consume(boxes, none);
      (void)finder.find(boxes, buffer.data(), buffer.size());
    }
    HeapCount::start();
    const Result one = finder.find(boxes);
    const std::size_t growing = HeapCount::stop();
    HeapCount::start();
    const Result two = finder.find(boxes, buffer.data(), buffer.size());
    const std::size_t callers = HeapCount::stop();
    HeapCount::start();
    const Result sets = finder.find(boxes, half);
    const std::size_t both = HeapCount::stop();
    HeapCount::start();
    const Result consumed = finder.consume(boxes, none);
    const std::size_t consuming = HeapCount::stop();
    EXPECT_TRUE(one.ok() && two.ok() && sets.ok() && consumed.ok());
    EXPECT_EQ(growing, 0u) << "into its own memory, " << boxes.size() << " boxes";
    EXPECT_EQ(callers, 0u) << "into the caller's buffer, " << boxes.size() << " boxes";
    EXPECT_EQ(both, 0u) << "of two sets, " << boxes.size() << " boxes";
    EXPECT_EQ(consuming, 0u) << "by a consumer, " << boxes.size() << " boxes";
  }
}

// With filters: layers and static boxes, and worlds in one place.
TEST_P(Embedding, FiltersUseOnlyTheResource) {
  const BoxList boxes = uniform_boxes(20000, 7);
  const std::size_t n = boxes.size();
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> world;
  std::vector<std::uint8_t> still;
  for (std::uint32_t i = 0; i < n; ++i) {
    group.push_back(1u << i % 5);
    mask.push_back(i % 5 == 2 ? 3u : 31u);
    world.push_back(static_cast<std::int32_t>(i % 100));
    still.push_back(i % 3 == 0);
  }
  Boxes layers = boxes, worlds = boxes;
  layers.filters.group = {group.data(), n};
  layers.filters.mask = {mask.data(), n};
  layers.filters.is_static = {still.data(), n};
  worlds.filters.world = {world.data(), n};
  for (const Boxes& view : {layers, worlds}) {
    HiddenResource memory;
    const Options with = embedding_options(&memory);
    Finder finder(with);
    HeapCount::start();
    const Result first = finder.find(view);
    EXPECT_EQ(HeapCount::stop(), 0u) << "allocations outside the memory resource";
    (void)finder.find(view);
    const std::size_t before = memory.allocations();
    HeapCount::start();
    const Result warm = finder.find(view);
    EXPECT_EQ(HeapCount::stop(), 0u);
    EXPECT_EQ(memory.allocations(), before);
    EXPECT_TRUE(first.ok() && warm.ok());
  }
}

// Frames of a moving scene, processed for the second time.
TEST_P(Embedding, AWarmFinderAllocatesNothingForMovingBoxes) {
  std::vector<BoxList> frames;
  Random random(6);
  for (int f = 0; f < 4; ++f) {
    frames.push_back(f == 0 ? uniform_boxes(8000, 9) : frames.back());
    for (Box& box : frames.back()) {
      const Vec3 step = random.point(-0.5f, 0.5f);
      box = cube(box.lower.x + step.x, box.lower.y + step.y, box.lower.z + step.z, 1);
    }
  }
  const Options with = embedding_options();
  Finder finder(with);
  for (const BoxList& frame : frames) (void)finder.find(frame);
  HeapCount::start();
  int found = 0;
  for (const BoxList& frame : frames) found += finder.find(frame).ok();
  EXPECT_EQ(HeapCount::stop(), 0u);
  EXPECT_EQ(found, 4);
}

// The same with the default executor, where scheduling decides which thread gets which work:
// allocations must soon cease, for ten runs. One thread is deterministic.
TEST_P(Embedding, AWarmFinderTakesNothingFromItsResource) {
  for (const auto& scene : embedding_scenes()) {
    HiddenResource memory;
    Options with = options();
    with.memory = &memory;
    Finder finder(with);
    const Boxes half(scene.boxes.data(), scene.boxes.size() / 2);
    const int max_runs = config().threads == 1 ? 12 : 200;
    int calm = 0, runs = 0;
    for (std::size_t before = 0; calm < 10 && runs < max_runs; ++runs) {
      EXPECT_TRUE(finder.find(scene.boxes).ok() && finder.find(scene.boxes, half).ok());
      calm = memory.allocations() == before ? calm + 1 : 0;
      before = memory.allocations();
    }
    EXPECT_GE(calm, 10) << "still allocating after " << runs << " runs";
  }
}

// Memory that fails at every possible point: reported, nothing lost, nothing leaked, and the Finder
// works again once there is memory.
TEST_P(Embedding, ReportsOutOfMemory) {
  const BoxList boxes = huge_among_small(4000, 2);
  const Answer answer = swept_pairs(boxes);
  CountingResource memory;
  {
    const Options with = embedding_options(&memory);
    std::size_t needed = 0;
    {
      Finder finder(with);
      ASSERT_TRUE(finder.find(boxes).ok());
      needed = memory.peak();
    }
    int refused = 0;
    for (int step = 0; step <= 40; ++step) {
      // The last is short by one byte.
      memory.limit(step < 40 ? needed * static_cast<std::size_t>(step) / 40 : needed - 1);
      Finder finder(with);
      const Result result = finder.find(boxes);
      if (result.ok()) {
        EXPECT_TRUE(same_pairs(to_vector(finder.pairs()), answer.pairs));
      } else {
        ++refused;
        EXPECT_EQ(result.status, Status::out_of_memory);
        EXPECT_GT(result.bytes_needed, 0u);
        EXPECT_NE(std::string(result.message).find(std::to_string(result.bytes_needed)),
                  std::string::npos)
            << result.message;
      }
      memory.limit(std::numeric_limits<std::size_t>::max());
      const Result again = finder.find(boxes);
      expect_pairs(again, config(), answer, to_vector(finder.pairs()), boxes.size());
    }
    EXPECT_GE(refused, 20);
  }
  EXPECT_EQ(memory.held(), 0u);
}

TEST_P(Embedding, FindersMoveAndEnd) {
  const BoxList boxes = uniform_boxes(900, 1);
  const Answer answer = reference_pairs(boxes);
  Finder first(options());
  ASSERT_TRUE(first.find(boxes).ok());
  Finder second(std::move(first));
  EXPECT_TRUE(same_pairs(to_vector(second.pairs()), answer.pairs));
  first = Finder(options());
  EXPECT_TRUE(first.find(boxes).ok());
  first = std::move(second);
  EXPECT_TRUE(same_pairs(to_vector(first.pairs()), answer.pairs));
  EXPECT_GT(first.memory_bytes(), 0u);
  second = Finder();
  EXPECT_EQ(second.pairs().size(), 0u);
  EXPECT_TRUE(second.find(boxes).ok());
}

// Different Finders on different threads at once.
TEST_P(Embedding, FindersAreIndependent) {
  const std::vector<BoxList> scenes = {uniform_boxes(3000, 1), identical_boxes(100, 2),
                                       rods(2000, 3)};
  std::vector<Answer> answers;
  for (const BoxList& boxes : scenes) answers.push_back(swept_pairs(boxes));
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 6; ++t) {
    threads.emplace_back([&, t] {
      Finder finder(options());
      for (int round = 0; round < 5; ++round) {
        const std::size_t s = (t + static_cast<std::size_t>(round)) % scenes.size();
        const Result result = finder.find(scenes[s]);
        if (!result.ok() || !same_pairs(to_vector(finder.pairs()), answers[s].pairs)) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

THRONG_INSTANTIATE(Embedding, embedding_configs);

TEST(HeapCountTest, SeesAllocations) {
  if (!HeapCount::complete()) GTEST_SKIP() << "this build does not count malloc";
  HeapCount::start();
  void* volatile block = std::malloc(10);
  int* volatile number = new int(3);
  EXPECT_EQ(HeapCount::stop(), 2u);
  std::free(block);
  delete number;
}

}  // namespace
}  // namespace throng::tests
