// Throng inside an engine: the engine's threads, its memory, its boxes of doubles.
#include <throng/throng.hpp>

#include <cstddef>
#include <memory_resource>
#include <vector>

#include "check.hpp"

namespace {

// snippet-begin: executor
// Stands for the engine's job system: calls task(context, i) for each i and waits for all of them.
struct Jobs {
  unsigned calls = 0;

  static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    static_cast<Jobs*>(self)->calls += count;
    for (unsigned i = 0; i < count; ++i) task(context, i);
  }
};
// snippet-end: executor

std::vector<throng::Box> chain(std::size_t count) {
  std::vector<throng::Box> boxes(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float x = static_cast<float>(i);
    boxes[i] = {{x, 0, 0}, {x + 1, 1, 1}};
  }
  return boxes;
}

}  // namespace

int main() {
  const std::vector<throng::Box> boxes = chain(100000);
  // snippet-begin: embedding
  Jobs jobs;
  throng::Executor executor;
  executor.concurrency = 4;
  executor.run = &Jobs::run;
  executor.self = &jobs;
  std::pmr::synchronized_pool_resource memory;

  throng::Options options;
  options.executor = &executor;  // the library starts no other thread
  options.memory = &memory;      // and allocates from nothing else
  throng::Finder finder(options);
  const throng::Result result = finder.find(boxes);
  // snippet-end: embedding
  CHECK(result.ok());
  CHECK(result.found == 99999);
  CHECK(jobs.calls > 0);

  // 0.1 is not a float. Rounding the box outward loses no touching pair.
  const double lower[3] = {0.1, 0.1, 0.1};
  const double upper[3] = {0.7, 0.7, 0.7};
  const throng::Box box = throng::round_outward(lower, upper);
  CHECK(static_cast<double>(box.lower.x) <= 0.1);
  CHECK(static_cast<double>(box.upper.x) >= 0.7);

  // snippet-begin: exact
  // Plates, a micrometer thick, a thousand kilometers from the origin. Every second plate begins
  // where the previous one ends; the others begin a nanometer later.
  std::vector<throng::DoubleBox> plates;
  double x = 1e6;
  for (int i = 0; i < 1000; ++i) {
    plates.push_back({{x, 0, 0}, {x + 1e-6, 1, 1}});
    x = plates.back().upper.x + (i % 2 ? 1e-9 : 0);
  }
  const std::vector<throng::Pair> touching = throng::find_pairs(plates);  // 500 of them
  // snippet-end: exact
  CHECK(touching.size() == 500);
}
