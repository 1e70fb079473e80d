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

void expect_same(const throng_ray_hit& got, const std::optional<RayHit>& want) {
  const RayHit none{THRONG_NO_OBJECT, 0, {0, 0, 0}, {0, 0, 0}};
  const RayHit hit = want.value_or(none);
  EXPECT_EQ(got.object, hit.object);
  EXPECT_EQ(got.distance, hit.distance);
  const Vec3 point = {got.point[0], got.point[1], got.point[2]};
  const Vec3 normal = {got.normal[0], got.normal[1], got.normal[2]};
  EXPECT_TRUE(point.x == hit.point.x && point.y == hit.point.y && point.z == hit.point.z);
  EXPECT_TRUE(normal.x == hit.normal.x && normal.y == hit.normal.y && normal.z == hit.normal.z);
}

TEST_F(CBroadPhase, RaycastMatchesTheCppApi) {
  std::vector<std::uint32_t> group(boxes_.size());
  for (std::size_t i = 0; i < group.size(); ++i) group[i] = 1u << i % 3;
  throng_boxes c_view = view(boxes_);
  c_view.group = {group.data(), 0};
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, nullptr), THRONG_OK) << message();
  Boxes cpp_view = boxes_;
  cpp_view.filters.group = {group.data(), group.size()};
  ASSERT_TRUE(cpp_.add(cpp_view, nullptr).ok());
  throng_query* const query = throng_query_create(nullptr);
  const auto odd = [](void* most, std::uint32_t id) {
    return int{id % 2 == 1 && id <= *static_cast<std::uint32_t*>(most)};
  };
  std::uint32_t most = 250;
  Random random(5);
  std::size_t hits = 0;
  for (int i = 0; i < 200; ++i) {
    const float origin[3] = {random.in(-3, 13), random.in(-3, 13), random.in(-3, 13)};
    const Box& aim = boxes_[random.below(300)];
    const float direction[3] = {(aim.lower.x + aim.upper.x) / 2 - origin[0],
                                (aim.lower.y + aim.upper.y) / 2 - origin[1],
                                (aim.lower.z + aim.upper.z) / 2 - origin[2]};
    const Vec3 from = {origin[0], origin[1], origin[2]};
    const Vec3 by = {direction[0], direction[1], direction[2]};
    const double max_distance = i % 3 == 0 ? 4 : HUGE_VAL;
    const std::uint32_t mask = i % 4 == 0 ? 5 : 0xffffffffu;
    throng_ray_hit hit;
    ASSERT_EQ(throng_broad_phase_raycast(c_, origin, direction, max_distance, mask, &hit),
              THRONG_OK);
    const std::optional<RayHit> want = cpp_.raycast(from, by, max_distance, mask);
    expect_same(hit, want);
    EXPECT_EQ(throng_broad_phase_result(c_)->found, want ? 1u : 0u);
    hits += want.has_value();

    ASSERT_EQ(throng_query_raycast(query, c_, origin, direction, max_distance, nullptr, nullptr,
                                   nullptr, &hit),
              THRONG_OK);
    expect_same(hit, cpp_.raycast(from, by, max_distance));
    const throng_filter of_ray = {0xffffffffu, mask, -1, -1, 0};
    ASSERT_EQ(
        throng_query_raycast(query, c_, origin, direction, max_distance, &of_ray, odd, &most, &hit),
        THRONG_OK);
    expect_same(hit, cpp_.raycast(from, by, max_distance, mask,
                                  [&](ObjectId id) { return id % 2 == 1 && id <= most; }));
  }
  EXPECT_GT(hits, 50u);

  // Invalid calls. A refused ray hits nothing.
  const float zero[3] = {0, 0, 0}, one[3] = {1, 0, 0};
  throng_ray_hit hit = {7, 1, {1, 1, 1}, {1, 1, 1}};
  EXPECT_EQ(throng_broad_phase_raycast(c_, zero, zero, 1, 1, &hit), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("direction: found (0, 0, 0)"), std::string::npos) << message();
  expect_same(hit, std::nullopt);
  EXPECT_EQ(throng_broad_phase_raycast(c_, zero, one, -1, 1, &hit), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("max_distance: found -1"), std::string::npos) << message();
  EXPECT_EQ(throng_broad_phase_raycast(c_, nullptr, one, 1, 1, &hit), THRONG_BAD_BOXES);
  EXPECT_EQ(message(), "found no origin of the ray (NULL), which this call needs");
  EXPECT_EQ(throng_broad_phase_raycast(c_, zero, nullptr, 1, 1, &hit), THRONG_BAD_BOXES);
  EXPECT_EQ(message(), "found no direction of the ray (NULL), which this call needs");
  EXPECT_EQ(throng_broad_phase_raycast(c_, zero, one, 1, 1, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(message(), "found no ray hit to write (NULL), which this call needs");
  EXPECT_EQ(throng_broad_phase_raycast(nullptr, zero, one, 1, 1, &hit), THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_query_raycast(query, nullptr, zero, one, 1, nullptr, nullptr, nullptr, &hit),
            THRONG_BAD_BOXES);
  EXPECT_STREQ(throng_query_result(query)->message,
               "found no broad phase (NULL), which this call needs");
  const throng_filter below = {1, 1, -1, -5, 0};
  EXPECT_EQ(throng_query_raycast(query, c_, zero, one, 1, &below, nullptr, nullptr, &hit),
            THRONG_BAD_FILTER);
  EXPECT_EQ(throng_query_raycast(nullptr, c_, zero, one, 1, nullptr, nullptr, nullptr, &hit),
            THRONG_OUT_OF_MEMORY);
  throng_query_destroy(query);
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
