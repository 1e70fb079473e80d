// Concurrent queries through the C API, with one handle per thread.
#include "broad_phase/c_api_fixture.hpp"

namespace throng::tests {
namespace {

TEST_F(CBroadPhase, ConcurrentQueriesMatchTheCppApi) {
  throng_boxes c_view = view(boxes_);
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, nullptr), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.add(boxes_, nullptr).ok());
  const std::vector<Box> queried = snapped_boxes(20, 10, 0.25f, 10);
  c_view = view(queried);
  throng_query* const query = throng_query_create(nullptr);
  ASSERT_NE(query, nullptr);
  BroadPhaseQuery cpp;
  ASSERT_EQ(throng_query_find_overlaps(query, c_, &c_view), THRONG_OK);
  ASSERT_TRUE(cpp.find_overlaps(cpp_, queried).ok());
  size_t count = 0;
  const throng_pair* const overlaps = throng_query_overlaps(query, &count);
  expect_same(overlaps, count, cpp.overlaps());
  EXPECT_GT(count, 20u);

  std::vector<Sweep> sweeps;
  for (const Box& b : queried) sweeps.push_back({b, {1, 2, -3}});
  const auto* const c_sweeps = reinterpret_cast<const throng_sweep*>(sweeps.data());
  const auto later = [](void* context, std::uint32_t sweep, std::uint32_t object, double time) {
    return (sweep + object) % 3 == 0 ? 2.0 : time + *static_cast<const double*>(context);
  };
  double by = 0.125;
  for (const throng_sweep_test test : {throng_sweep_test{later}, throng_sweep_test{nullptr}}) {
    for (const int which : {THRONG_HITS_ALL, THRONG_HITS_FIRST}) {
      ASSERT_EQ(
          throng_query_find_hits(query, c_, c_sweeps, sweeps.size(), which, nullptr, test, &by),
          THRONG_OK);
      const SweepTest cpp_test{test, &by};
      ASSERT_TRUE(cpp.find_hits(cpp_, sweeps.data(), sweeps.size(), static_cast<SweepHits>(which),
                                {}, cpp_test)
                      .ok());
      const throng_sweep_hit* const hits = throng_query_hits(query, &count);
      expect_same(hits, count, cpp.hits());
      EXPECT_EQ(throng_query_result(query)->found, count);
      EXPECT_GT(count, 10u);
    }
  }
  EXPECT_GT(throng_query_memory_bytes(query), 0u);

  const auto hits_of = [&](throng_query* q, const throng_broad_phase* b, int which) {
    return throng_query_find_hits(q, b, c_sweeps, 1, which, nullptr, nullptr, nullptr);
  };
  EXPECT_EQ(hits_of(query, c_, 7), THRONG_BAD_OPTION);
  EXPECT_EQ(hits_of(query, nullptr, THRONG_HITS_ALL), THRONG_BAD_BOXES);
  EXPECT_STREQ(throng_query_result(query)->message,
               "found no broad phase (NULL), which this call needs");
  EXPECT_EQ(throng_query_find_overlaps(query, nullptr, &c_view), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_query_find_overlaps(query, c_, nullptr), THRONG_BAD_BOXES);
  EXPECT_STREQ(throng_query_result(query)->message, "found no boxes (NULL), which this call needs");
  throng_query_destroy(query);

  throng_query* const none = nullptr;
  EXPECT_EQ(hits_of(none, c_, THRONG_HITS_ALL), THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_query_hits(none, &count), nullptr);
  EXPECT_EQ(throng_query_overlaps(none, &count), nullptr);
  EXPECT_EQ(throng_query_result(none)->status, THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_query_memory_bytes(none), 0u);
  throng_query_stop(none);
  throng_query_destroy(none);
}

// Calls from within a query, as from another thread.
TEST_F(CBroadPhase, ChangesAreRefusedDuringAQuery) {
  throng_boxes c_view = view(boxes_);
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, nullptr), THRONG_OK) << message();
  struct ReentrantCaller {
    throng_broad_phase* objects;
    throng_query *query, *other;
    throng_boxes region;
    int update, own, others;
  } m{c_, throng_query_create(nullptr), throng_query_create(nullptr), view(boxes_), -1, -1, -1};
  m.region.count = 1;
  const auto call_reentrantly = [](void* context, std::uint32_t, std::uint32_t, double time) {
    auto& me = *static_cast<ReentrantCaller*>(context);
    me.update = throng_broad_phase_update(me.objects);
    me.own = throng_query_find_overlaps(me.query, me.objects, &me.region);
    me.others = throng_query_find_overlaps(me.other, me.objects, &me.region);
    return time;
  };
  const Sweep sweep{boxes_[0], {1, 0, 0}};
  EXPECT_EQ(throng_query_find_hits(m.query, c_, reinterpret_cast<const throng_sweep*>(&sweep), 1,
                                   THRONG_HITS_FIRST, nullptr, call_reentrantly, &m),
            THRONG_OK);
  EXPECT_EQ(m.update, THRONG_BUSY);
  EXPECT_EQ(m.own, THRONG_BUSY);
  EXPECT_EQ(m.others, THRONG_OK);
  EXPECT_EQ(throng_broad_phase_update(c_), THRONG_OK) << message();
  throng_query_destroy(m.query);
  throng_query_destroy(m.other);
}

}  // namespace
}  // namespace throng::tests
