// Where a worker writes pairs: directly into the output while that has space, except in brute force
// within a nested grid.
#include "grid/emit/worker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include <throng/large_pages.hpp>

#include "support/random.hpp"

namespace throng::grid {
namespace {

void put(Worker& worker, std::uint32_t k) {
  *worker.cursor++ = {k, k + 1};
  if (worker.cursor > worker.limit) worker.flush();
}

// Two workers alternately write 0, 1, 2, ..., each alternating between grid search and brute force.
TEST(Workers, ResumeDirectWrites) {
  constexpr std::uint32_t most = 60000;
  std::vector<std::uint32_t> ids(most + 1);
  std::iota(ids.begin(), ids.end(), 0u);
  const std::vector<RejectMask> before(most + 1);
  const ParentCell parent{ids.data(), before.data()};
  const Boxes none;
  base::Memory memory(large_pages(), 0);
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    tests::Random random(seed);
    const std::uint32_t count = static_cast<std::uint32_t>(random.unit() * most);
    // Capacity for all pairs and some more or, sometimes, for fewer.
    const std::size_t capacity = seed % 4 == 0 ? count / 2 : count + seed % 3 * 100;
    std::vector<Pair> out(capacity + 1, Pair{77, 78}), spill(BufferSink::spill_for(2, capacity));
    BufferSink sink(out.data(), capacity, spill.data(), spill.size());
    Search search;
    search.a = search.b = &none;
    search.sink = &sink;
    Worker first(memory), second(memory);
    Worker* const workers[] = {&first, &second};
    for (Worker* w : workers) w->begin(search);
    const auto inside = [&](const Worker& w) {
      return w.cursor >= out.data() && w.cursor <= out.data() + capacity;
    };
    EXPECT_TRUE(capacity < 30000 || (inside(first) && inside(second)));
    for (std::uint32_t k = 0; k < count;) {
      Worker& w = *workers[random.unit() < 0.5f];
      const bool use_sweep = random.unit() < 0.7f;
      use_sweep ? w.use_sweep() : w.use_brute_force(&parent);
      EXPECT_FALSE(!use_sweep && inside(w));
      // Blocks are an eighth of the rest, so one is always available, except for the last few
      // pairs.
      EXPECT_TRUE(!use_sweep || k + 20000 > capacity || inside(w));
      const float share = random.unit();
      const auto some = static_cast<std::uint32_t>(3000 * share * share * share) + 1;
      for (const std::uint32_t end = std::min(count, k + some); k < end; ++k) put(w, k);
    }
    for (Worker* w : workers) w->finish();
    sink.close();
    ASSERT_EQ(sink.found(), count);
    ASSERT_EQ(sink.written(), std::min<std::size_t>(count, capacity));
    out.resize(static_cast<std::size_t>(sink.written()));
    std::sort(out.begin(), out.end(), [](Pair a, Pair b) { return a.first < b.first; });
    for (std::size_t i = 0; i < out.size(); ++i) {
      ASSERT_EQ(out[i].second, out[i].first + 1);
      ASSERT_TRUE(count > capacity || out[i].first == i);
      ASSERT_TRUE(i == 0 || out[i - 1].first < out[i].first);
    }
  }
}

}  // namespace
}  // namespace throng::grid
