// C API of BroadPhase: the same results as the C++ API after the same calls, and its errors.
#include <algorithm>
#include <cstdlib>
#include <limits>
#include <random>

#include "broad_phase/c_api_fixture.hpp"
#include "support/aligned_memory.hpp"

namespace throng::tests {
namespace {

TEST_F(CBroadPhase, MatchesTheCppApi) {
  std::vector<std::int32_t> owners(boxes_.size());
  for (std::size_t i = 0; i < owners.size(); ++i) owners[i] = static_cast<std::int32_t>(i % 5);
  std::vector<std::uint32_t> ids(boxes_.size()), cpp_ids(boxes_.size());
  const std::vector<std::uint32_t> groups(boxes_.size(), 6), masks(boxes_.size(), 3);
  throng_boxes c_view = view(boxes_);
  c_view.group = {groups.data(), sizeof(std::uint32_t)};
  c_view.mask = {masks.data(), sizeof(std::uint32_t)};
  c_view.owner = {owners.data(), sizeof(std::int32_t)};
  Boxes cpp_view(boxes_);
  cpp_view.filters.group = {groups.data(), groups.size(), sizeof(std::uint32_t)};
  cpp_view.filters.mask = {masks.data(), masks.size(), sizeof(std::uint32_t)};
  cpp_view.filters.owner = {owners.data(), owners.size(), sizeof(std::int32_t)};
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, ids.data()), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.add(cpp_view, cpp_ids.data()).ok());
  EXPECT_EQ(ids, cpp_ids);
  update_both_and_compare();
  EXPECT_GT(throng_broad_phase_pair_count(c_), 100u);

  const std::vector<Box> moved = snapped_boxes(40, 10, 0.25f, 8);
  c_view = view(moved);
  EXPECT_EQ(throng_broad_phase_move(c_, ids.data() + 20, &c_view), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.move(ids.data() + 20, moved).ok());
  update_both_and_compare();
  EXPECT_FALSE(cpp_.begun().empty());
  EXPECT_FALSE(cpp_.ended().empty());

  EXPECT_EQ(throng_broad_phase_remove(c_, ids.data() + 100, 50), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.remove(ids.data() + 100, 50).ok());
  EXPECT_FALSE(throng_broad_phase_is_alive(c_, ids[100]));
  EXPECT_TRUE(throng_broad_phase_is_alive(c_, ids[99]));
  throng_boxes unfiltered = view(boxes_);
  unfiltered.count = 60;
  const std::vector<std::int32_t> no_owner(60, -1);
  unfiltered.owner = {no_owner.data(), sizeof(std::int32_t)};
  EXPECT_EQ(throng_broad_phase_set_filters(c_, ids.data(), &unfiltered), THRONG_OK) << message();
  Filters filters;
  filters.owner = {no_owner.data(), 60, sizeof(std::int32_t)};
  ASSERT_TRUE(cpp_.set_filters(ids.data(), 60, filters).ok());
  update_both_and_compare();

  const std::vector<Box> others = snapped_boxes(300, 10, 0.25f, 9);
  c_view = view(others);
  EXPECT_EQ(throng_broad_phase_move_all(c_, &c_view), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.move_all(others).ok());
  const float by[3] = {0.5f, -3, 7};
  EXPECT_EQ(throng_broad_phase_shift_origin(c_, by), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.shift_origin({0.5f, -3, 7}).ok());
  update_both_and_compare();
  throng_box box;
  ASSERT_EQ(throng_broad_phase_box(c_, 17, &box), THRONG_OK);
  EXPECT_EQ(box.upper[2], cpp_.box(17).upper.z);
  EXPECT_EQ(throng_broad_phase_box(c_, ids[100], &box), THRONG_BAD_ID);
  throng_filter filter;
  ASSERT_EQ(throng_broad_phase_filter(c_, 63, &filter), THRONG_OK);
  EXPECT_EQ(filter.owner, 3);
  EXPECT_EQ(filter.group, 6u);
  EXPECT_EQ(filter.mask, 3u);
  EXPECT_EQ(filter.world, -1);
  EXPECT_EQ(filter.is_static, 0);
  ASSERT_EQ(throng_broad_phase_filter(c_, 59, &filter), THRONG_OK);
  EXPECT_EQ(filter.owner, -1);
}

TEST_F(CBroadPhase, PairsOfOneObject) {
  throng_boxes c_view = view(boxes_);
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, nullptr), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.add(boxes_, nullptr).ok());
  update_both_and_compare();
  std::size_t most = 0;
  for (std::uint32_t id = 0; id < boxes_.size() + 2; ++id) {
    std::vector<LivePair> want(boxes_.size());
    want.resize(cpp_.pairs_of(id, want.data(), want.size()));
    const std::size_t count = throng_broad_phase_pairs_of(c_, id, nullptr, 0);
    ASSERT_EQ(count, want.size());
    EXPECT_EQ(throng_broad_phase_pairs_of(c_, id, nullptr, 999), count);
    std::vector<throng_live_pair> got(count);
    EXPECT_EQ(throng_broad_phase_pairs_of(c_, id, got.data(), count), count);
    EXPECT_EQ(rows(got.data(), count), rows({want.data(), want.size()}));
    most = std::max(most, count);
  }
  EXPECT_GT(most, 2u);
}

TEST_F(CBroadPhase, QueriesMatchTheCppApi) {
  throng_boxes c_view = view(boxes_);
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, nullptr), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.add(boxes_, nullptr).ok());
  const std::vector<Box> queried = snapped_boxes(20, 10, 0.25f, 10);
  c_view = view(queried);
  ASSERT_EQ(throng_broad_phase_find_overlaps(c_, &c_view), THRONG_OK) << message();
  ASSERT_TRUE(cpp_.find_overlaps(queried).ok());
  size_t count = 0;
  const throng_pair* const overlaps = throng_broad_phase_overlaps(c_, &count);
  expect_same(overlaps, count, cpp_.overlaps());
  EXPECT_GT(count, 20u);

  std::vector<Sweep> sweeps;
  for (const Box& b : queried) sweeps.push_back({b, {1, 2, -3}});
  const auto* const c_sweeps = reinterpret_cast<const throng_sweep*>(sweeps.data());
  std::vector<std::int32_t> worlds(sweeps.size(), -1);
  throng_boxes filters{};
  filters.world = {worlds.data(), sizeof(std::int32_t)};
  for (const int which : {THRONG_HITS_ALL, THRONG_HITS_FIRST}) {
    ASSERT_EQ(throng_broad_phase_find_hits(c_, c_sweeps, sweeps.size(), which, &filters), THRONG_OK)
        << message();
    ASSERT_TRUE(cpp_.find_hits(sweeps.data(), sweeps.size(), static_cast<SweepHits>(which)).ok());
    const throng_sweep_hit* const hits = throng_broad_phase_hits(c_, &count);
    expect_same(hits, count, cpp_.hits());
    EXPECT_GT(count, 10u);
  }
  worlds[3] = -2;
  EXPECT_EQ(throng_broad_phase_find_hits(c_, c_sweeps, sweeps.size(), THRONG_HITS_ALL, &filters),
            THRONG_BAD_FILTER);
  EXPECT_EQ(throng_broad_phase_find_hits(c_, c_sweeps, 1, 7, nullptr), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("THRONG_HITS_"), std::string::npos) << message();
}

TEST_F(CBroadPhase, CopiesAreSnapshots) {
  throng_boxes c_view = view(boxes_);
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, nullptr), THRONG_OK);
  ASSERT_EQ(throng_broad_phase_update(c_), THRONG_OK);
  const std::vector<Row> before = event_rows(throng_broad_phase_begun);
  throng_broad_phase* const saved = throng_broad_phase_create(nullptr);
  ASSERT_EQ(throng_broad_phase_copy(saved, c_), THRONG_OK);
  const std::uint32_t id = 0;
  EXPECT_EQ(throng_broad_phase_remove(c_, &id, 1), THRONG_OK);
  EXPECT_EQ(throng_broad_phase_update(c_), THRONG_OK);
  EXPECT_NE(event_rows(throng_broad_phase_begun), before);
  EXPECT_EQ(throng_broad_phase_copy(c_, saved), THRONG_OK);
  throng_broad_phase_destroy(saved);
  EXPECT_EQ(event_rows(throng_broad_phase_begun), before);
  EXPECT_TRUE(throng_broad_phase_is_alive(c_, 0));
  EXPECT_EQ(throng_broad_phase_copy(c_, nullptr), THRONG_BAD_BOXES);
}

TEST_F(CBroadPhase, BadInputIsReportedAndChangesNothing) {
  throng_boxes c_view = view(boxes_);
  ASSERT_EQ(throng_broad_phase_add(c_, &c_view, nullptr), THRONG_OK);
  ASSERT_TRUE(cpp_.add(boxes_, nullptr).ok());
  const std::uint32_t twice[] = {4, 4}, dead = 4000;
  EXPECT_EQ(throng_broad_phase_remove(c_, twice, 2), THRONG_BAD_ID);
  EXPECT_EQ(throng_broad_phase_result(c_)->first_invalid, 1u);
  EXPECT_EQ(throng_broad_phase_remove(c_, &dead, 1), THRONG_BAD_ID);
  EXPECT_NE(message().find("4000"), std::string::npos) << message();
  for (const size_t count : {size_t{1}, boxes_.size(), boxes_.size() + 1}) {
    EXPECT_EQ(throng_broad_phase_remove(c_, nullptr, count), THRONG_BAD_ID);
    EXPECT_NE(message().find("ids is null"), std::string::npos) << message();
  }
  EXPECT_EQ(throng_broad_phase_move(c_, nullptr, &c_view), THRONG_BAD_ID);
  EXPECT_NE(message().find("ids is null"), std::string::npos) << message();
  EXPECT_EQ(throng_broad_phase_set_filters(c_, nullptr, &c_view), THRONG_BAD_ID);
  EXPECT_EQ(throng_broad_phase_move(c_, twice, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_broad_phase_box(c_, 0, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_broad_phase_box(c_, dead, nullptr), THRONG_BAD_ID);
  EXPECT_EQ(throng_broad_phase_filter(c_, 0, nullptr), THRONG_BAD_FILTER);
  throng_filter filter;
  EXPECT_EQ(throng_broad_phase_filter(c_, dead, &filter), THRONG_BAD_ID);
  std::vector<Box> broken(1, boxes_[0]);
  broken[0].lower.x = std::numeric_limits<float>::quiet_NaN();
  c_view = view(broken);
  EXPECT_EQ(throng_broad_phase_move(c_, twice, &c_view), THRONG_NAN_BOX);
  EXPECT_EQ(throng_broad_phase_add(c_, nullptr, nullptr), THRONG_BAD_BOXES);
  EXPECT_NE(message().find("NULL"), std::string::npos) << message();
  EXPECT_EQ(throng_broad_phase_move_all(c_, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_broad_phase_set_filters(c_, twice, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_broad_phase_shift_origin(c_, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_broad_phase_find_overlaps(c_, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_broad_phase_find_hits(c_, nullptr, 1, THRONG_HITS_ALL, nullptr),
            THRONG_BAD_BOXES);
  EXPECT_NE(message().find("sweeps is null"), std::string::npos) << message();
  EXPECT_EQ(throng_broad_phase_find_hits(c_, nullptr, 0, THRONG_HITS_ALL, nullptr), THRONG_OK);
  throng_options_init_sized(nullptr, sizeof(throng_options));
  update_both_and_compare();

  throng_options options;
  throng_options_init(&options);
  options.backend = THRONG_BACKEND_CUDA;
  throng_broad_phase* const other = throng_broad_phase_create(&options);
  EXPECT_EQ(throng_broad_phase_update(other), THRONG_BAD_OPTION);
  throng_broad_phase_destroy(other);
}

// When out of memory, the handle is NULL: every call reports this and none crashes.
TEST_F(CBroadPhase, ANullHandleIsAnError) {
  throng_boxes c_view = view(boxes_);
  std::uint32_t id = 0;
  size_t count = 7;
  EXPECT_EQ(throng_broad_phase_add(nullptr, &c_view, &id), THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_broad_phase_update(nullptr), THRONG_OUT_OF_MEMORY);
  throng_box box;
  EXPECT_EQ(throng_broad_phase_box(nullptr, 0, &box), THRONG_OUT_OF_MEMORY);
  throng_filter filter;
  EXPECT_EQ(throng_broad_phase_filter(nullptr, 0, &filter), THRONG_OUT_OF_MEMORY);
  throng_live_pair pair;
  EXPECT_EQ(throng_broad_phase_pairs_of(nullptr, 0, &pair, 1), 0u);
  EXPECT_EQ(throng_broad_phase_begun(nullptr, &count), nullptr);
  EXPECT_EQ(count, 0u);
  EXPECT_EQ(throng_broad_phase_pairs(nullptr, nullptr), nullptr);
  EXPECT_EQ(throng_broad_phase_hits(nullptr, nullptr), nullptr);
  EXPECT_EQ(throng_broad_phase_overlaps(nullptr, nullptr), nullptr);
  EXPECT_EQ(throng_broad_phase_id_limit(nullptr), 0u);
  EXPECT_EQ(throng_broad_phase_result(nullptr)->status, THRONG_OUT_OF_MEMORY);
  EXPECT_STRNE(throng_broad_phase_result(nullptr)->message, "");
  EXPECT_EQ(throng_find(nullptr, &c_view, nullptr), THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_finder_pairs(nullptr, &count), nullptr);
  EXPECT_EQ(throng_finder_result(nullptr)->status, THRONG_OUT_OF_MEMORY);
  throng_finder_stop(nullptr), throng_broad_phase_stop(nullptr);
  EXPECT_EQ(throng_finder_memory_bytes(nullptr) + throng_broad_phase_memory_bytes(nullptr), 0u);
}

TEST_F(CBroadPhase, AnUpdateThatIsStoppedChangesNothing) {
  struct Stopper {
    throng_broad_phase* objects = nullptr;
    bool stops = false;
  } stopper;
  throng_options options;
  throng_options_init(&options);
  options.stoppable = 1;
  options.concurrency = 2;
  options.run_self = &stopper;
  options.run = [](void* self, unsigned n, void (*task)(void*, unsigned), void* context) {
    const Stopper& s = *static_cast<Stopper*>(self);
    EXPECT_EQ(throng_broad_phase_update(s.objects), THRONG_BUSY);
    if (s.stops) throng_broad_phase_stop(s.objects);
    for (unsigned i = 0; i < n; ++i) task(context, i);
  };
  stopper.objects = throng_broad_phase_create(&options);
  const tests::BoxList boxes = tests::uniform_boxes(20000, 8);
  const throng_boxes c_view = view(boxes);
  std::vector<std::uint32_t> ids(boxes.size());
  ASSERT_EQ(throng_broad_phase_add(stopper.objects, &c_view, ids.data()), THRONG_OK);
  stopper.stops = true;
  EXPECT_EQ(throng_broad_phase_update(stopper.objects), THRONG_STOPPED);
  EXPECT_EQ(throng_broad_phase_pair_count(stopper.objects), 0u);
  stopper.stops = false;
  EXPECT_EQ(throng_broad_phase_update(stopper.objects), THRONG_OK);
  EXPECT_EQ(throng_broad_phase_pair_count(stopper.objects), tests::swept_pairs(boxes).pairs.size());
  EXPECT_GT(throng_broad_phase_memory_bytes(stopper.objects), 24 * boxes.size());
  throng_broad_phase_destroy(stopper.objects);
}

// All allocations use the caller's memory, except the handle itself.
TEST_F(CBroadPhase, UsesTheCallersMemory) {
  static size_t held;
  held = 0;
  throng_options options;
  throng_options_init(&options);
  options.allocate = [](void*, size_t bytes, size_t alignment) -> void* {
    held += bytes;
    return allocate_aligned(bytes, alignment);
  };
  options.deallocate = [](void*, void* p, size_t bytes, size_t) {
    held -= bytes;
    free_aligned(p);
  };
  options.run = [](void*, unsigned n, void (*task)(void*, unsigned), void* context) {
    for (unsigned i = 0; i < n; ++i) task(context, i);
  };
  options.concurrency = 1;
  throng_broad_phase* const mine = throng_broad_phase_create(&options);
  throng_boxes c_view = view(boxes_);
  ASSERT_EQ(throng_broad_phase_add(mine, &c_view, nullptr), THRONG_OK);
  ASSERT_EQ(throng_broad_phase_update(mine), THRONG_OK);
  EXPECT_GT(held, boxes_.size() * sizeof(Box));
  throng_broad_phase_destroy(mine);
  EXPECT_EQ(held, 0u);
}

}  // namespace
}  // namespace throng::tests
