// Cost of persistent objects on a device: candidates of fat boxes are kept, memory is proportional
// to objects and pairs, and running out of memory changes nothing.
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "device/device_actor.hpp"
#include "support/counting_resource.hpp"
#include "support/failing_resource.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

TEST(PersistentScene, CostFollowsTheMovers) {
  Options options;
  options.algorithm = Algorithm::grid;
  EmulatedBroadPhase m(options, 0.25f);
  BoxList boxes = uniform_boxes(3000, 1);
  Model model;
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  for (std::size_t i = 0; i < boxes.size(); ++i)
    ASSERT_TRUE(model.add(static_cast<ObjectId>(i), boxes[i], {}));
  const auto update = [&](const char* reason) {
    const Result r = m.update();
    EXPECT_TRUE(r.ok());
    EXPECT_NE(std::string(r.plan.reason).find(reason), std::string::npos) << r.plan.reason;
    model.update();
    EXPECT_TRUE(model.check(m));
    return r;
  };
  (void)update("all candidates found");
  const std::uint64_t candidates = m.candidate_count();
  EXPECT_GT(candidates, m.pair_count() * 5 / 4);
  ASSERT_TRUE(m.move_all(boxes).ok());
  EXPECT_EQ(update("nothing moved").comparisons, 0u);
  const auto shift = [&](std::size_t id, float by) {
    boxes[id].lower.x += by, boxes[id].upper.x += by;
    model.at(static_cast<ObjectId>(id)).box = boxes[id];
  };
  shift(17, 0.2f);
  ASSERT_TRUE(m.move_all(boxes).ok());
  EXPECT_LT(update("compared again").comparisons, 100u);
  for (std::size_t id = 0; id < boxes.size(); ++id) shift(id, id == 17 ? 0.01f : 0.2f);
  ASSERT_TRUE(m.move_all(boxes).ok());
  EXPECT_EQ(update("compared again").comparisons, candidates);
  EXPECT_EQ(m.candidate_count(), candidates);
  shift(17, 0.2f);
  ASSERT_TRUE(m.move_all(boxes).ok());
  EXPECT_LT(update("few boxes left").comparisons, 100u);
  for (std::size_t id = 0; id < boxes.size(); id += 2) shift(id, 0.2f);
  ASSERT_TRUE(m.move_all(boxes).ok());
  (void)update("all candidates found");
  // Removed objects end their pairs without a new search for candidates.
  std::vector<ObjectId> ids;
  for (ObjectId id = 0; id < 3000; id += 2) ids.push_back(id), model.remove(id);
  ASSERT_TRUE(m.remove(ids.data(), ids.size()).ok());
  (void)update("compared again");
}

// A moving object far from a dense heap of static boxes, or above it, is compared with none of
// them.
TEST(PersistentScene, MoversNextToAHeap) {
  for (const float width : {1.0f, 8.0f}) {
    Random r(5);
    BoxList heap;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 at = r.point(1000, 1000 + width);
      heap.push_back({{at.x - 2, at.y - 2, at.z - 2}, {at.x + 2, at.y + 2, at.z + 2}});
    }
    const std::vector<std::uint8_t> is_static(heap.size(), 1);
    Boxes view = heap;
    view.filters.is_static = {is_static.data(), is_static.size()};
    EmulatedBroadPhase m({}, 0.1f);
    ASSERT_TRUE(m.add(view, nullptr).ok());
    const Box first = cube(0, 0, 0, 1);
    ObjectId mover = 0;
    ASSERT_TRUE(m.add(Boxes(&first, 1), &mover).ok());
    EXPECT_EQ(m.update().comparisons, 0u);
    for (int step = 0; step < 6; ++step) {
      const float x = static_cast<float>(step);
      const Box there = step < 3 ? cube(x, 3, 0, 1) : cube(1000 + x, 1003 + width, 1000, 1);
      ASSERT_TRUE(m.move(&mover, Boxes(&there, 1)).ok());
      EXPECT_LE(m.update().comparisons, heap.size() / 2) << step;
      EXPECT_EQ(m.pair_count(), 0u);
    }
  }
}

// After a heap has been unpacked object by object, updates and queries cost as much as in a scene
// created in its final state.
TEST(PersistentScene, AnUnpackedHeapIsLikeANewScene) {
  constexpr int count = 4000, frames = 50;
  Random r(5);
  BoxList boxes, to;
  const float side = side_of(count * 4.0f);
  for (int i = 0; i < count; ++i) {
    boxes.push_back(cube(r.point(0, 5), 1));
    to.push_back(cube(r.point(-side / 2, side / 2), 1));
  }
  EmulatedBroadPhase old({}, 0.1f), fresh({}, 0.1f);
  ASSERT_TRUE(old.add(boxes, nullptr).ok());
  ASSERT_TRUE(old.update().ok());
  const auto move = [&](EmulatedBroadPhase& m, int step) {
    std::vector<ObjectId> ids;
    BoxList moved;
    for (int i = step; i < count; i += frames) {
      ids.push_back(static_cast<ObjectId>(i));
      moved.push_back(to[static_cast<std::size_t>(i)]);
    }
    EXPECT_TRUE(m.move(ids.data(), moved).ok());
    const Result result = m.update();
    EXPECT_TRUE(result.ok());
    return result.comparisons;
  };
  for (int step = 0; step < frames; ++step) (void)move(old, step);
  ASSERT_TRUE(fresh.add(to, nullptr).ok());
  ASSERT_TRUE(fresh.update().ok());
  std::uint64_t unpacked = 0, as_new = 0;
  for (int step = 0; step < 20; ++step) {
    for (Box& b : to) b.lower.x += 0.3f, b.upper.x += 0.3f;
    unpacked += move(old, step);
    as_new += move(fresh, step);
  }
  EXPECT_LE(unpacked, as_new * 3 / 2);
  const BoxList query_boxes(to.begin(), to.begin() + 500);
  EXPECT_LE(old.find_overlaps(query_boxes).comparisons,
            fresh.find_overlaps(query_boxes).comparisons * 3 / 2);
}

// Launches and synchronizations of an update.
TEST(PersistentScene, FewLaunchesAndWaits) {
  Options options;
  options.algorithm = Algorithm::grid;
  EmulatedBroadPhase m(options, 0.25f);
  BoxList boxes = uniform_boxes(3000, 1);
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  ASSERT_TRUE(m.update().ok());
  m.combine_with_update(true);
  const auto costs = [&](const char* reason, std::size_t launches, std::size_t syncs) {
    const std::size_t puts_before = m.launches(), waits_before = m.syncs();
    ASSERT_TRUE(m.move_all(boxes).ok());
    const Result r = m.update();
    ASSERT_TRUE(r.ok());
    EXPECT_NE(std::string(r.plan.reason).find(reason), std::string::npos) << r.plan.reason;
    EXPECT_LE(m.launches() - puts_before, launches) << reason;
    EXPECT_LE(m.syncs() - waits_before, syncs) << reason;
  };
  const auto shift = [&](std::size_t step, float by) {
    for (std::size_t i = 0; i < boxes.size(); i += step) {
      const float there = i * 7 % 3 ? by : -by;  // so that pairs begin and end
      boxes[i].lower.y += there, boxes[i].upper.y += there;
    }
  };
  costs("nothing moved", 4, 1);
  for (int k = 0; k < 3; ++k) costs("nothing moved", 1, 1);
  shift(3000, 1e-4f);  // one object; no pair begins or ends
  costs("compared again", 5, 2);
  shift(3000, -1e-4f);
  costs("compared again", 8, 1);  // the uncertain candidates are listed
  shift(1, 0.1f);
  costs("compared again", 8, 2);  // and counted
  for (const float by : {-0.1f, 0.1f, -0.1f}) {
    shift(1, by);
    costs("compared again", 7, 1);
    EXPECT_FALSE(m.begun().empty());
  }
  for (const float by : {0.6f, -0.6f, 0.6f}) {
    shift(100, by);
    costs("few boxes left", 37, 5);
  }
  for (const float by : {0.6f, -0.6f, 0.6f}) {
    shift(2, by);
    costs("all candidates found", 28, 4);
  }
  shift(2, 0.6f);
  costs("all candidates found", 26, 4);
  shift(100, 0.6f);
  costs("few boxes left", 38, 6);
}

// More begin and end events in one update than the capacity reserved for them.
TEST(PersistentScene, ManyChangesAtOnce) {
  EmulatedBroadPhase m({}, 1);
  BoxList boxes;
  for (int k = 0; k < 3000; ++k) {
    const float x = 10.0f * static_cast<float>(k);
    boxes.push_back(cube(x, 0, 0, 1));
    boxes.push_back(cube(x + 1.5f, 0, 0, 1));
  }
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  ASSERT_TRUE(m.update().ok());
  EXPECT_EQ(m.pair_count(), 0u);
  ASSERT_EQ(m.candidate_count(), 3000u);
  for (int round = 0; round < 4; ++round) {
    for (std::size_t i = 0; i < boxes.size(); i += 2) {
      const float by = round % 2 ? -0.75f : 0.75f;
      boxes[i].lower.x += by, boxes[i].upper.x += by;
    }
    ASSERT_TRUE(m.move_all(boxes).ok());
    const Result r = m.update();
    ASSERT_TRUE(r.ok());
    EXPECT_NE(std::string(r.plan.reason).find("compared again"), std::string::npos);
    EXPECT_EQ(m.begun().size(), round % 2 ? 0u : 3000u);
    EXPECT_EQ(m.ended().size(), round % 2 ? 3000u : 0u);
    EXPECT_EQ(m.pairs().size(), m.pair_count());
    EXPECT_EQ(m.slot_limit(), 3000u);
    for (std::size_t k = 0; k < m.begun().size(); ++k) {
      EXPECT_EQ(m.begun()[k].first, 2 * k);
    }
  }
}

// A few objects leave and meet: more candidates among them than the capacity reserved.
TEST(PersistentScene, EscapedObjectsMeet) {
  Options options;
  options.algorithm = Algorithm::grid;
  EmulatedBroadPhase m(options, 0.1f);
  BroadPhase plain;
  BoxList boxes = uniform_boxes(6000, 1);
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  ASSERT_TRUE(plain.add(boxes, nullptr).ok());
  ASSERT_TRUE(m.update().ok());
  ASSERT_TRUE(plain.update().ok());
  for (std::size_t i = 0; i < boxes.size(); i += 10) boxes[i] = cube(3, 3, 3, 1);
  ASSERT_TRUE(m.move_all(boxes).ok());
  ASSERT_TRUE(plain.move_all(boxes).ok());
  ASSERT_TRUE(m.update().ok());
  ASSERT_TRUE(plain.update().ok());
  EXPECT_EQ(std::string(m.last_reason()).find("few boxes left"), 0u) << m.last_reason();
  EXPECT_GT(m.pair_count(), 600u * 599 / 2);
  EXPECT_TRUE(same_bytes(m.pairs(), plain.pairs()));
  EXPECT_TRUE(same_bytes(m.begun(), plain.begun()));
}

TEST(PersistentScene, MemoryRunsOutAtEveryAllocation) {
  FailingResource memory;
  std::pmr::memory_resource* resource = &memory;
  Options options;
  options.algorithm = Algorithm::grid;
  DeviceActor actor(options, 3, 14, 0.3f, resource);
  actor.in_worlds = false;
  EmulatedBroadPhase& m = actor.broad_phase;
  const auto see = [&] { return VisibleState(m); };
  std::size_t in_objects = 0, in_updates = 0;
  UpdateCounts update_counts;
  for (int step = 0; step < 24; ++step) {
    if (step % 6 == 0) {
      BoxList boxes;
      std::vector<Filter> filters;
      for (int k = 0; k < 80 + 20 * step; ++k) {
        boxes.push_back(actor.any_box());
        filters.push_back(step ? actor.any_filter() : Filter{});
      }
      Boxes view = boxes;
      if (step) view.filters = actor.given(filters);
      std::vector<ObjectId> ids(boxes.size());
      in_objects += until_it_works(memory, see, [&] { return m.add(view, ids.data()); });
      for (std::size_t i = 0; i < ids.size(); ++i)
        ASSERT_TRUE(actor.model.add(ids[i], boxes[i], filters[i]));
    }
    if (step % 5 == 3) {
      const std::vector<ObjectId> ids = actor.some_ids(3);
      in_objects += until_it_works(memory, see, [&] { return m.remove(ids.data(), ids.size()); });
      for (const ObjectId id : ids) actor.model.remove(id);
    }
    m.combine_with_update(step % 3 == 0);
    ASSERT_TRUE(actor.move_all(step % 6 < 2 ? 2 : 50));
    in_updates += until_it_works(memory, see, [&] {
      const Result r = m.update();
      if (!r.ok()) update_counts.count(r.plan.reason);
      return r;
    });
    actor.model.update();
    ASSERT_TRUE(actor.model.check(m)) << "step " << step;
  }
  EXPECT_GT(in_objects, 12u);
  EXPECT_GT(in_updates, 20u);
  EXPECT_GT(update_counts.repaired, 2u) << "no failure while candidates were repaired";
  EmulatedBroadPhase copy({}, 0.3f, &memory);
  ASSERT_TRUE(copy.add(BoxList{cube(0, 0, 0, 1), cube(0, 0, 0, 2)}, nullptr).ok());
  ASSERT_TRUE(copy.update().ok());
  EXPECT_GT(until_it_works(
                memory, [&] { return VisibleState(copy); }, [&] { return copy.copy_from(m); }),
            3u);
  EXPECT_TRUE(VisibleState(copy) == VisibleState(m));
}

// Zeroes memory when it is released.
class ZeroingResource : public FailingResource {
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override {
    std::memset(memory, 0, bytes);
    FailingResource::do_deallocate(memory, bytes, alignment);
  }
};

// A refused add() may have moved the filter arrays of the others.
TEST(PersistentScene, FewLeaveTheirBoxesAfterARefusal) {
  ZeroingResource memory;
  Options options;
  options.algorithm = Algorithm::grid;
  BoxList boxes;
  for (int i = 0; i < 400; ++i) {
    boxes.push_back(cube(static_cast<float>(i % 10), static_cast<float>(i / 10 % 10),
                         static_cast<float>(i / 100), 0.9f));
  }
  BoxList more = boxes;
  more.insert(more.end(), boxes.begin(), boxes.end());
  const std::vector<std::uint32_t> group(800, 1), mask(800, 0xffffffffu);
  const std::vector<std::int32_t> owner(800, -1);
  const auto with_filters = [&](const BoxList& list) {
    Boxes view = list;
    view.filters.owner = {owner.data(), list.size(), 4};
    view.filters.group = {group.data(), list.size(), 4};
    view.filters.mask = {mask.data(), list.size(), 4};
    return view;
  };
  std::size_t refused = 0;
  for (std::size_t allowed = 0; allowed < 10; ++allowed) {
    EmulatedBroadPhase m(options, 0.3f, &memory), plain({}, 0);
    for (EmulatedBroadPhase* broad_phase : {&m, &plain}) {
      ASSERT_TRUE(broad_phase->add(with_filters(boxes), nullptr).ok());
      ASSERT_TRUE(broad_phase->update().ok());
    }
    memory.fail(allowed, false);
    const bool grown = m.add(with_filters(more), nullptr).ok();
    memory.calm();
    if (grown) break;
    ++refused;
    BoxList moved;
    std::vector<ObjectId> ids;
    for (ObjectId id = 0; id < 185; id += 37) {
      ids.push_back(id);
      moved.push_back(boxes[id]);
      moved.back().lower.x += 1.5f, moved.back().upper.x += 1.5f;
    }
    for (EmulatedBroadPhase* broad_phase : {&m, &plain}) {
      ASSERT_TRUE(broad_phase->move(ids.data(), moved).ok());
      ASSERT_TRUE(broad_phase->update().ok());
    }
    EXPECT_EQ(std::string(m.last_reason()).find("few boxes left"), 0u) << m.last_reason();
    EXPECT_TRUE(same_bytes(m.pairs(), plain.pairs())) << "refused after " << allowed;
  }
  EXPECT_GT(refused, 4u);
}

// Warm updates allocate nothing; memory is bounded per object and per candidate.
TEST(PersistentScene, MemoryIsObjectsAndPairs) {
  CountingResource memory;
  {
    EmulatedBroadPhase m({}, 0.1f, &memory);
    BoxList boxes = uniform_boxes(20000, 1);
    ASSERT_TRUE(m.add(boxes, nullptr).ok());
    ASSERT_TRUE(m.update().ok());
    const std::uint64_t candidates = m.candidate_count();
    EXPECT_LT(memory.peak(), 130 * boxes.size() + 90 * candidates + 400000);
    std::size_t warm = 0;
    for (int frame = 0; frame < 12; ++frame) {
      if (frame == 6) warm = memory.allocations();
      // Some objects stay within their fat boxes; in every third frame all do.
      for (Box& b : boxes) {
        const float by = frame % 3 ? 0.02f : frame % 2 ? 0.4f : -0.4f;
        b.lower.y += by, b.upper.y += by;
      }
      ASSERT_TRUE(m.move_all(boxes).ok());
      ASSERT_TRUE(m.update().ok());
      (void)m.pairs();
    }
    EXPECT_EQ(memory.allocations(), warm);
    EXPECT_EQ(m.held(), memory.held());
  }
  EXPECT_EQ(memory.held(), 0u);
}

// A copy is independent. After a rollback the same calls give the same results, slots and ids
// included.
TEST(PersistentScene, SnapshotAndRollback) {
  Options options;
  options.algorithm = Algorithm::grid;
  DeviceActor actor(options, 4, 8, 0.5f);
  actor.in_worlds = false;
  EmulatedBroadPhase& m = actor.broad_phase;
  ASSERT_TRUE(actor.add(200, true));
  ASSERT_TRUE(actor.update());
  ASSERT_TRUE(actor.remove(20));
  ASSERT_TRUE(actor.update());
  ASSERT_TRUE(actor.move(5));  // unreported changes are part of the copy
  ASSERT_TRUE(actor.remove(2));
  EmulatedBroadPhase saved(Options{}, 0);
  ASSERT_TRUE(saved.copy_from(m).ok());
  const Model model = actor.model;
  const Random random = actor.random;
  std::vector<VisibleState> first;
  for (int round = 0; round < 2; ++round) {
    for (int k = 0; k < 20; ++k) {
      // At first so few that candidates are repaired, but not in the grid from before the rollback.
      ASSERT_TRUE(actor.move(1 + actor.random.below(k % 3 != 2 ? 3 : 200)));
      if (k % 5 == 4) {
        ASSERT_TRUE(actor.add(3, true));
      }
      if (k % 7 == 0) {
        ASSERT_TRUE(actor.remove(4));
      }
      ASSERT_TRUE(actor.update());
      if (round == 0)
        first.emplace_back(m);
      else
        ASSERT_TRUE(VisibleState(m) == first[static_cast<std::size_t>(k)]) << k;
    }
    ASSERT_TRUE(m.copy_from(saved).ok());
    actor.model = model;
    actor.random = random;
  }
}

}  // namespace
}  // namespace throng::tests
