// The stack use of a search.
#include <pthread.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

#include <throng/throng.hpp>

#include "support/configs.hpp"
#include "support/in_turn.hpp"

namespace throng::tests {
namespace {

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
    for (const auto& [backend, algorithm] :
         {std::pair{Backend::cpu, Algorithm::grid}, std::pair{Backend::cpu, Algorithm::all_pairs},
          std::pair{Backend::emulated, Algorithm::grid}}) {
      Options options;
      options.backend = backend;
      options.algorithm = algorithm;
      options.executor = &here;
      options.order = Order::canonical;
      Boxes some(boxes.data(), algorithm == Algorithm::all_pairs ? 3000 : boxes.size());
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
