// The process can start no thread.
#include <dlfcn.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>

#include <throng/throng.hpp>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace {

std::atomic<bool> no_threads{false};
std::atomic<unsigned> threads_refused{0};

}  // namespace

// Sanitizers have their own, which must see each thread.
#if !THRONG_SANITIZED
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*start)(void*), void* argument) {
  if (no_threads) {
    ++threads_refused;
    return EAGAIN;
  }
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto real = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
  return real(thread, attributes, start, argument);
}
#endif

namespace throng::tests {
namespace {

// Must run first, before any thread has been started. The caller runs the tasks of missing threads.
TEST(FailingProcess, HasNoThreads) {
  if (sanitized) GTEST_SKIP() << "sanitizers replace pthread_create";
  const BoxList boxes = uniform_boxes(20000, 1);
  const Answer answer = swept_pairs(boxes);
  Options options;
  options.threads = 4;
  no_threads = true;
  Finder finder(options);
  const Result r = finder.find(boxes);
  BroadPhase persistent(options);
  std::vector<ObjectId> ids(boxes.size());
  const Result added = persistent.add(boxes, ids.data()), updated = persistent.update();
  no_threads = false;
  EXPECT_GT(threads_refused, 0u) << "no thread was requested";
  EXPECT_TRUE(r.ok()) << r.message;
  EXPECT_TRUE(same_pairs(to_vector(finder.pairs()), answer.pairs));
  EXPECT_TRUE(added.ok() && updated.ok());
  EXPECT_EQ(updated.found, answer.pairs.size());
  EXPECT_TRUE(finder.find(boxes).ok());
  EXPECT_TRUE(same_pairs(to_vector(finder.pairs()), answer.pairs));
}

}  // namespace
}  // namespace throng::tests
