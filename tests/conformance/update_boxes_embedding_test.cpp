// Embedded update_boxes: a given executor is the only source of threads, and nothing is allocated.
// In the program of embedding_test, before it, while the process has one thread.
#include <thread>

#include "support/body_scenes.hpp"
#include "support/heap_count.hpp"
#include "support/thread_count.hpp"

namespace throng::tests {
namespace {

struct Backwards {
  unsigned runs = 0, most_tasks = 0, foreign_thread_runs = 0;
  std::size_t most_threads = 0;
  std::thread::id caller = std::this_thread::get_id();

  // Runs every task on the caller, the last first.
  static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    auto& me = *static_cast<Backwards*>(self);
    const bool counting = HeapCount::pause();  // this work is not the library's
    ++me.runs;
    me.most_tasks = std::max(me.most_tasks, count);
    me.foreign_thread_runs += std::this_thread::get_id() != me.caller;
    me.most_threads = std::max(me.most_threads, thread_count());
    HeapCount::resume(counting);
    for (unsigned i = count; i-- > 0;) task(context, i);
  }
};

TEST(UpdateBoxesEmbedding, NoThreadAndNoByte) {
  const BodyScene scene = body_scene(50000, 1);
  Backwards backwards;
  Executor executor;
  executor.concurrency = 4;
  executor.run = &Backwards::run;
  executor.self = &backwards;
  UpdateOptions options;
  options.executor = &executor;
  std::vector<Box> boxes(scene.transforms.size());
  const std::size_t before = thread_count();
  for (const unsigned threads : {0u, 1u, 3u}) {
    options.threads = threads;
    HeapCount::start();
    const Result r = update_boxes(scene.view(), boxes.data(), options);
    const std::size_t allocations = HeapCount::stop();
    EXPECT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(allocations, 0u);
    EXPECT_EQ(r.plan.threads, threads == 0 ? 4u : threads);
  }
  EXPECT_EQ(backwards.runs, 2u) << "one thread: the caller";
  EXPECT_EQ(backwards.most_tasks, 4u);
  EXPECT_EQ(backwards.foreign_thread_runs, 0u);
  EXPECT_EQ(backwards.most_threads, before);
  EXPECT_EQ(thread_count(), before);
}

// Errors allocate nothing, too.
TEST(UpdateBoxesEmbedding, ErrorsAllocateNothing) {
  BodyScene scene = body_scene(100, 2);
  scene.shape[7] = 1u << 30;
  std::vector<Box> boxes(scene.transforms.size());
  HeapCount::start();
  const Result wrong = update_boxes(scene.view(), boxes.data());
  const Result refused = update_boxes(scene.view(), nullptr);
  const std::size_t allocations = HeapCount::stop();
  EXPECT_EQ(wrong.status, Status::bad_shape);
  EXPECT_EQ(refused.status, Status::bad_bodies);
  EXPECT_EQ(allocations, 0u);
}

}  // namespace
}  // namespace throng::tests
