// Options::stop: a search that is told to end does, leaves no thread behind and can search again.
#include <atomic>
#include <chrono>
#include <thread>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Stop : public Conformance {
 protected:
  void SetUp() override {
    if (config().backend == Backend::emulated) GTEST_SKIP() << "heeded on the CPU alone";
  }
  Options stoppable() const {
    Options o = options();
    o.stop = &stop_;
    return o;
  }
  std::atomic<bool> stop_{false};
};

void expect_stopped(const Result& r) {
  EXPECT_EQ(r.status, Status::stopped);
  EXPECT_EQ(r.found, 0u);
  EXPECT_EQ(r.written, 0u);
}

TEST_P(Stop, BeforeItBegins) {
  Finder finder(stoppable());
  for (const BoxList& boxes : {uniform_boxes(7000, 1), identical_boxes(300, 2), BoxList{}}) {
    stop_ = true;
    expect_stopped(finder.find(boxes));
    EXPECT_TRUE(finder.pairs().empty());
    stop_ = false;
    const Result r = finder.find(boxes);
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.found, reference_pairs(boxes).pairs.size());
  }
}

// From the consumer, which a search has reached its middle to call: more blocks would follow.
TEST_P(Stop, InTheMiddle) {
  if (config().order == Order::canonical) GTEST_SKIP() << "pairs come when all are found";
  const BoxList boxes = identical_boxes(3000, 2);
  Finder finder(stoppable());
  std::uint64_t seen = 0;
  const Result r = finder.consume(boxes, [&](const Pair*, std::size_t count) {
    seen += count;
    stop_ = true;
    return true;
  });
  // A column is not looked into: where all boxes lie in one, everything has been found.
  expect_stopped(r);
  EXPECT_GT(seen, 0u);
  stop_ = false;
  EXPECT_EQ(finder.find(boxes).found, 3000u * 2999 / 2);
}

// As a user interface does it: 8e10 comparisons, of which few are made.
TEST_P(Stop, FromAnotherThread) {
  Options o = stoppable();
  if (o.algorithm != Algorithm::all_pairs) GTEST_SKIP() << "a grid would be done too soon";
  const BoxList boxes = uniform_boxes(400000, 1);
  std::thread impatient([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    stop_ = true;
  });
  Finder finder(o);
  const Result r = finder.find(boxes);
  impatient.join();
  expect_stopped(r);
  EXPECT_LT(r.comparisons, 79'000'000'000u);
}

THRONG_INSTANTIATE(Stop, all_configs);

}  // namespace
}  // namespace throng::tests
