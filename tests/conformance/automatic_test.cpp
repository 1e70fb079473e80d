// Backend::automatic: the pairs are correct with or without a GPU, and the plan names the backend
// used.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// Few pairs, so that the boxes dominate the cost.
const BoxList& many_boxes() {
  static const BoxList boxes = [] {
    BoxList all;
    Random r(1);
    for (int k = 0; k < 500000; ++k) all.push_back(cube(r.point(0, 1000), 2));
    return all;
  }();
  return boxes;
}

Options automatic(unsigned threads) {
  Options o;
  o.threads = threads;
  o.order = Order::canonical;
  return o;
}

std::vector<Pair> runs_on_cpu() {
  Options o = automatic(0);
  o.backend = Backend::cpu;
  return find_pairs(many_boxes(), o);
}

// The message for a GPU that cannot be used; empty if one can, or if this build has no GPU backend.
bool says_why(const Result& r) { return std::string(r.plan.reason).find("on the CPU: ") == 0; }

TEST(Automatic, LargeSetIsExact) {
  const Result available = cuda::available();
  const bool gpu = available.ok();
  // A build without the backend has no choice.
  const bool expects_reason =
      !gpu && std::string(available.message).find("this build") == std::string::npos;
  const std::vector<Pair> want = runs_on_cpu();
  ASSERT_GT(want.size(), 1000u);
  Finder finder(automatic(1));
  for (int frame = 0; frame < 3; ++frame) {
    const Result r = finder.find(many_boxes());
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_STREQ(r.message, "");
    EXPECT_TRUE(to_vector(finder.pairs()) == want);
    EXPECT_EQ(r.plan.backend, gpu && frame > 0 ? Backend::cuda : Backend::cpu);
    EXPECT_EQ(says_why(r), expects_reason && frame > 0) << r.plan.reason;
    if (expects_reason && frame > 0) {
      EXPECT_STREQ(r.plan.reason, "on the CPU: no GPU can be used, cuda::available() says why");
      EXPECT_NE(r.plan.isa, Isa::automatic) << "the rest of the plan is the CPU's";
    }
  }
  // The other forms, and two sets.
  std::vector<Pair> out(want.size());
  EXPECT_TRUE(finder.find(many_boxes(), out.data(), out.size()).ok());
  EXPECT_TRUE(out == want);
  std::vector<Pair> blocks;
  const auto take = [&](const Pair* pairs, std::size_t count) {
    blocks.insert(blocks.end(), pairs, pairs + count);
    return true;
  };
  EXPECT_TRUE(finder.consume(many_boxes(), take).ok());
  EXPECT_TRUE(blocks == want);
  const Boxes half(many_boxes().data(), 250000), rest(many_boxes().data() + 250000, 250000);
  const Result two = finder.find(half, rest);
  EXPECT_TRUE(two.ok());
  EXPECT_GT(two.found, 0u);
  EXPECT_EQ(says_why(two), expects_reason);
  EXPECT_FALSE(says_why(finder.find(Boxes(many_boxes().data(), 199999))))
      << "so few boxes run on the CPU";
}

// With caller's threads or memory, a named instruction set, many threads or few boxes: the CPU, and
// no message about a GPU.
TEST(Automatic, NotWhereTheCallerWantsTheCpu) {
  std::pmr::synchronized_pool_resource memory;
  Executor executor;
  executor.run = [](void*, unsigned count, void (*task)(void*, unsigned), void* context) {
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  std::vector<Options> all(5, automatic(1));
  all[0].memory = &memory;
  all[1].executor = &executor;
  all[2].isa = Isa::scalar;
  all[3].backend = Backend::cpu;
  all[4].threads = 5;
  for (const Options& o : all) {
    Finder finder(o);
    for (int frame = 0; frame < 2; ++frame) {
      const Result r = finder.find(many_boxes());
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_EQ(r.plan.backend, Backend::cpu);
      EXPECT_FALSE(says_why(r)) << r.plan.reason;
    }
  }
  Finder finder(automatic(1));
  for (int frame = 0; frame < 3; ++frame) {
    const Result r = finder.find(Boxes(many_boxes().data(), 199999));
    EXPECT_EQ(r.plan.backend, Backend::cpu);
    EXPECT_FALSE(says_why(r)) << r.plan.reason;
  }
}

}  // namespace
}  // namespace throng::tests
