// The contract of each call: ids, slots, and errors that name the cause and change nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "broad_phase/snapshot.hpp"
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// Two that touch, one apart.
const BoxList three = {cube(0, 0, 0, 1), cube(1, 0, 0, 1), cube(5, 0, 0, 1)};

struct World {
  BroadPhase b;
  explicit World(const Options& options = {}) : b(options) {
    EXPECT_TRUE(b.add(three, nullptr).ok());
    EXPECT_TRUE(b.update().ok());
  }
};

using List = std::vector<Pair>;

TEST(BroadPhaseCalls, BeginAndEnd) {
  World w;
  EXPECT_EQ(plain(w.b.begun()), (List{{0, 1}}));
  EXPECT_EQ(plain(w.b.pairs()), (List{{0, 1}}));
  EXPECT_EQ(w.b.begun()[0].slot, w.b.pairs()[0].slot);
  EXPECT_TRUE(w.b.ended().empty());

  EXPECT_EQ(w.b.move(2, cube(-1, 0, 0, 1)), Status::ok);  // a teleport
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_EQ(plain(w.b.begun()), (List{{0, 2}}));
  EXPECT_EQ(plain(w.b.pairs()), (List{{0, 1}, {0, 2}}));

  EXPECT_EQ(w.b.remove(0), Status::ok);
  EXPECT_EQ(plain(w.b.pairs()), (List{{0, 1}, {0, 2}})) << "before the update";
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_EQ(plain(w.b.ended()), (List{{0, 1}, {0, 2}}));
  EXPECT_TRUE(w.b.begun().empty());
  EXPECT_TRUE(w.b.pairs().empty());

  EXPECT_TRUE(w.b.update().ok());
  EXPECT_TRUE(w.b.ended().empty()) << "reported twice";
}

TEST(BroadPhaseCalls, TheLastMoveWins) {
  World w;
  EXPECT_EQ(w.b.move(0, cube(100, 0, 0, 1)), Status::ok);
  EXPECT_EQ(w.b.move(0, cube(0, 0, 0, 1)), Status::ok);
  EXPECT_EQ(w.b.move(2, cube(0, 1, 0, 1)), Status::ok);
  EXPECT_EQ(w.b.move(2, cube(4, 0, 0, 1)), Status::ok);
  EXPECT_EQ(w.b.box(2).lower.x, 4);
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_TRUE(w.b.begun().empty());
  EXPECT_TRUE(w.b.ended().empty());
}

TEST(BroadPhaseCalls, UnchangedBoxesHaveNotMoved) {
  World w;
  const ObjectId ids[] = {0, 2};
  ASSERT_TRUE(w.b.move(ids, BoxList{three[0], three[2]}).ok());
  ASSERT_TRUE(w.b.move_all(three).ok());
  EXPECT_STREQ(w.b.update().plan.reason, "nothing changed");
  EXPECT_EQ(w.b.pair_count(), 1u);
}

TEST(BroadPhaseCalls, IdsAreReusedAfterTheirEndIsReported) {
  World w;
  EXPECT_EQ(w.b.remove(1), Status::ok);
  EXPECT_FALSE(w.b.is_alive(1));
  EXPECT_EQ(w.b.add(three[1]), 3u) << "the end of id 1 is not reported yet";
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_EQ(plain(w.b.ended()), (List{{0, 1}}));
  EXPECT_EQ(plain(w.b.begun()), (List{{0, 3}}));
  EXPECT_NE(w.b.begun()[0].slot, w.b.ended()[0].slot);
  EXPECT_EQ(w.b.add(three[1]), 1u);
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_EQ(plain(w.b.begun()), (List{{0, 1}, {1, 3}}));
  // Added and removed between two updates: not reported.
  const ObjectId brief = w.b.add(three[0]);
  EXPECT_EQ(w.b.remove(brief), Status::ok);
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_TRUE(w.b.begun().empty() && w.b.ended().empty());
}

TEST(BroadPhaseCalls, FiltersOfLiveObjects) {
  World w;
  Filter f;
  f.group = 2;
  EXPECT_EQ(w.b.set_filter(0, f), Status::ok);
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_TRUE(w.b.ended().empty()) << "a mask of all ones accepts any group";
  f.mask = 1;
  EXPECT_EQ(w.b.set_filter(1, f), Status::ok);
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_EQ(plain(w.b.ended()), (List{{0, 1}}));
  // Absent filters stay.
  const std::uint32_t mask = 2;
  Filters filters;
  filters.mask = {&mask, 1};
  const ObjectId id = 1;
  EXPECT_TRUE(w.b.set_filters(&id, 1, filters).ok());
  EXPECT_EQ(w.b.filter(1).group, 2u);
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_EQ(plain(w.b.begun()), (List{{0, 1}}));
}

TEST(BroadPhaseCalls, ShiftOfOrigin) {
  World w;
  EXPECT_TRUE(w.b.shift_origin({-100, 0.1f, 0}).ok());
  EXPECT_EQ(w.b.box(1).lower.x, -99);
  EXPECT_EQ(w.b.box(1).upper.y, 1 + 0.1f);
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_TRUE(w.b.begun().empty() && w.b.ended().empty());
  // At this distance one float spacing exceeds 1: all boxes touch.
  EXPECT_TRUE(w.b.shift_origin({1e12f, 0, 0}).ok());
  EXPECT_TRUE(w.b.update().ok());
  EXPECT_EQ(plain(w.b.pairs()), (List{{0, 1}, {0, 2}, {1, 2}}));
  const Result r = w.b.shift_origin({infinity, 0, 0});
  EXPECT_EQ(r.status, Status::bad_option);
  EXPECT_NE(std::string(r.message).find("inf"), std::string::npos);
}

// Rounding makes the corners of an empty slot equal; it stays inactive.
TEST(BroadPhaseCalls, AShiftKeepsSlotsInactive) {
  for (int axis = 0; axis < 3; ++axis) {
    BroadPhase b;
    BoxList boxes = three;
    (&boxes[1].lower.x)[axis] = (&boxes[1].upper.x)[axis] + 1;
    ASSERT_TRUE(b.add(boxes, nullptr).ok());
    EXPECT_EQ(b.update().inactive, 1u);
    for (const float by : {1e12f, -1e12f, -1e12f, 3e38f, 3e38f, -3e38f, -3e38f, -3e38f}) {
      Vec3 shift = {0, 0, 0};
      (&shift.x)[axis] = by;
      ASSERT_TRUE(b.shift_origin(shift).ok());
      const Result r = b.update();
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_EQ(r.inactive, 1u) << axis << " by " << by;
      const Box box = b.box(1);
      EXPECT_GT((&box.lower.x)[axis], (&box.upper.x)[axis]) << axis << " by " << by;
      for (const LivePair& pair : b.pairs())
        EXPECT_TRUE(pair.first != 1 && pair.second != 1) << axis << " by " << by;
    }
  }
}

TEST(BroadPhaseCalls, InactiveBoxesAreCounted) {
  World w;
  EXPECT_EQ(w.b.move(1, {{1, 1, 1}, {0, 0, 0}}), Status::ok);
  Result r = w.b.update();
  EXPECT_EQ(r.inactive, 1u);
  EXPECT_EQ(plain(w.b.ended()), (List{{0, 1}}));
  EXPECT_EQ(w.b.move(1, three[1]), Status::ok);
  r = w.b.update();
  EXPECT_EQ(r.inactive, 0u);
  EXPECT_EQ(plain(w.b.begun()), (List{{0, 1}}));
  Options options;
  options.nan = NanPolicy::inactive;
  World lenient(options);
  EXPECT_EQ(lenient.b.move(1, {{1, 1, std::nanf("")}, {2, 2, 2}}), Status::ok);
  EXPECT_EQ(lenient.b.update().inactive, 1u);
  EXPECT_EQ(lenient.b.remove(1), Status::ok);
  EXPECT_EQ(lenient.b.update().inactive, 0u) << "a removed object is not an inactive one";
}

TEST(BroadPhaseCalls, WrongIds) {
  World w;
  EXPECT_EQ(w.b.remove(2), Status::ok);
  const Snapshot before(w.b);
  const auto refused = [&](const Result& r, std::size_t first, std::size_t count,
                           const char* word) {
    EXPECT_EQ(r.status, Status::bad_id);
    EXPECT_EQ(r.first_invalid, first);
    EXPECT_EQ(r.invalid_count, count);
    EXPECT_NE(std::string(r.message).find(word), std::string::npos) << r.message;
    EXPECT_EQ(Snapshot(w.b), before);
  };
  const BoxList two(2, cube(9, 9, 9, 1));
  const Filters none;
  const ObjectId dead[] = {0, 2}, beyond[] = {77, 0}, twice[] = {1, 1}, many[] = {0, 1, 0, 1};
  refused(w.b.remove(dead, 2), 1, 1, "not alive");
  refused(w.b.remove(beyond, 2), 0, 1, "id 77");
  refused(w.b.remove(twice, 2), 1, 1, "twice");
  refused(w.b.remove(many, 4), 2, 2, "twice");
  refused(w.b.remove(nullptr, 2), 0, 2, "2 ids");
  refused(w.b.move(dead, two), 1, 1, "not alive");
  refused(w.b.move(twice, two), 1, 1, "twice");
  refused(w.b.set_filters(beyond, 2, none), 0, 1, "id 77");
  EXPECT_EQ(w.b.remove(2), Status::bad_id);
  EXPECT_EQ(w.b.move(0xffffffffu, two[0]), Status::bad_id);
  EXPECT_EQ(w.b.set_filter(2, {}), Status::bad_id);
  EXPECT_EQ(Snapshot(w.b), before);
  EXPECT_TRUE(w.b.remove(nullptr, 0).ok());
}

TEST(BroadPhaseCalls, WrongBoxes) {
  World w;
  EXPECT_EQ(w.b.remove(2), Status::ok);
  const Snapshot before(w.b);
  BoxList boxes = three;
  boxes[1].upper.z = std::nanf("");
  const auto refused = [&](const Result& r, Status status, std::size_t first) {
    EXPECT_EQ(r.status, status) << r.message;
    EXPECT_EQ(r.first_invalid, first);
    EXPECT_STRNE(r.message, "");
    EXPECT_EQ(Snapshot(w.b), before);
  };
  const ObjectId ids[] = {0, 1};
  refused(w.b.add(boxes, nullptr), Status::nan_box, 1);
  refused(w.b.move(ids, Boxes(boxes.data(), 2)), Status::nan_box, 1);
  refused(w.b.move_all(boxes), Status::nan_box, 1);
  refused(w.b.move_all(Boxes(boxes.data(), 2)), Status::bad_boxes, 0);
  refused(w.b.add(Boxes(static_cast<const Box*>(nullptr), 3), nullptr), Status::bad_boxes, 0);
  refused(w.b.add(Boxes(three.data(), 2, 13), nullptr), Status::bad_boxes, 0);
  const std::int32_t worlds[] = {0, -2};
  Boxes filtered(three.data(), 2);
  filtered.filters.world = {worlds, 2};
  refused(w.b.add(filtered, nullptr), Status::bad_filter, 1);
  refused(w.b.set_filters(ids, 2, filtered.filters), Status::bad_filter, 1);
  filtered.filters.world = {worlds, 1};
  refused(w.b.set_filters(ids, 2, filtered.filters), Status::bad_filter, 0);
  EXPECT_THROW(w.b.add(boxes[1]), Error);
  ObjectId id = 77;
  EXPECT_EQ(w.b.add(boxes[1], {}, id), Status::nan_box);
  EXPECT_EQ(id, 77u);
  EXPECT_EQ(Snapshot(w.b), before);
  // For a list, the message names the index and the id.
  const ObjectId other_order[] = {1, 0};
  const BoxList listed = {three[1], boxes[1]};
  const Result refused_move = w.b.move(other_order, listed);
  refused(refused_move, Status::nan_box, 1);
  EXPECT_NE(std::string(refused_move.message).find("box 1 of the list, for id 0"),
            std::string::npos)
      << refused_move.message;
  // The box of an id that is not alive is ignored.
  boxes = three;
  boxes[2].lower.x = std::nanf("");
  EXPECT_TRUE(w.b.move_all(boxes).ok());
}

// Empty slots by default; if refused, nothing changes.
TEST(BroadPhaseCalls, InvertedBoxes) {
  BoxList boxes = three;
  boxes[1].lower.y = boxes[1].upper.y + 1;
  World lenient;
  EXPECT_TRUE(lenient.b.move_all(boxes).ok());
  EXPECT_EQ(lenient.b.update().inactive, 1u);
  EXPECT_TRUE(lenient.b.find_overlaps(boxes).ok());

  Options options;
  options.inverted = InvertedPolicy::refuse;
  World w(options);
  ASSERT_EQ(w.b.remove(2), Status::ok);
  const Snapshot before(w.b);
  const auto refused = [&](const Result& r, std::size_t first) {
    EXPECT_EQ(r.status, Status::inverted_box) << r.message;
    EXPECT_EQ(r.first_invalid, first);
    EXPECT_EQ(r.invalid_count, 1u);
    EXPECT_NE(std::string(r.message).find("lower > upper"), std::string::npos) << r.message;
    EXPECT_EQ(Snapshot(w.b), before);
  };
  const ObjectId ids[] = {0, 1};
  const Sweep sweeps[] = {{three[0], {1, 0, 0}}, {boxes[1], {1, 0, 0}}};
  refused(w.b.add(boxes, nullptr), 1);
  refused(w.b.move(ids, Boxes(boxes.data(), 2)), 1);
  refused(w.b.move_all(boxes), 1);
  refused(w.b.find_overlaps(boxes), 1);
  refused(w.b.find_hits(sweeps, 2), 1);
  EXPECT_EQ(w.b.move(1, boxes[1]), Status::inverted_box);
  // The box of an id that is not alive is ignored.
  boxes = three;
  boxes[2].lower.x = 100;
  EXPECT_TRUE(w.b.move_all(boxes).ok());
}

TEST(BroadPhaseCalls, WrongOptions) {
  Options options;
  options.margin = -1;
  EXPECT_EQ(BroadPhase(options).update().status, Status::bad_option);
  options = {};
  options.backend = Backend::cuda;
  const Result r = BroadPhase(options).add(three, nullptr);
  EXPECT_EQ(r.status, Status::bad_option);
  EXPECT_NE(std::string(r.message).find("cuda"), std::string::npos);
}

// A call from within another one, as from another thread.
TEST(BroadPhaseCalls, OneCallAtATime) {
  struct ReentrantCaller {
    BroadPhase* b = nullptr;
    std::vector<Status> got;
    static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
      auto& me = *static_cast<ReentrantCaller*>(self);
      if (me.b) {
        std::thread([&] {
          const ObjectId id = 0;
          me.got = {me.b->update().status, me.b->remove(&id, 1).status,
                    BroadPhase().copy_from(*me.b).status, me.b->move(0, three[2])};
        }).join();
      }
      for (unsigned i = 0; i < count; ++i) task(context, i);
    }
  } reentrant_caller;
  Executor executor{4, &ReentrantCaller::run, &reentrant_caller};
  Options options;
  options.executor = &executor;
  BroadPhase b(options);
  const BoxList boxes = uniform_boxes(20000, 1);
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  reentrant_caller.b = &b;
  ASSERT_TRUE(b.update().ok());
  ASSERT_EQ(reentrant_caller.got.size(), 4u);
  for (const Status status : reentrant_caller.got) EXPECT_EQ(status, Status::busy);
  EXPECT_EQ(plain(b.pairs()), swept_pairs(boxes).pairs);
}

TEST(BroadPhaseCalls, Empty) {
  BroadPhase b;
  EXPECT_TRUE(b.pairs().empty() && b.begun().empty() && b.ended().empty());
  EXPECT_EQ(b.object_count() + b.pair_count() + b.id_limit() + b.slot_limit(), 0u);
  EXPECT_EQ(b.memory_bytes(), 0u);
  EXPECT_FALSE(b.is_alive(0));
  EXPECT_TRUE(b.update().ok());
  EXPECT_TRUE(b.move_all({}).ok());
  EXPECT_TRUE(b.add(BoxList{}, nullptr).ok());
  EXPECT_TRUE(b.shift_origin({1, 2, 3}).ok());
  EXPECT_TRUE(b.update().ok());
  EXPECT_TRUE(BroadPhase(b).update().ok());
}

// Extremes for the planner and the cells: only infinite boxes, one point, far away.
TEST(BroadPhaseCalls, ExtremeBoxes) {
  for (const auto& boxes :
       {infinite_bounds(300, 1), identical_boxes(200, 2), huge_among_small(600, 3),
        many_huge(300, 4), clusters_and_outliers(800, 5)}) {
    BroadPhase b;
    ASSERT_TRUE(b.add(boxes, nullptr).ok());
    ASSERT_TRUE(b.update().ok());
    const Answer all = reference_pairs(boxes);
    EXPECT_EQ(plain(b.begun()), all.pairs);
    // Removed and added again, a few at a time.
    for (std::size_t step = 0; step < 60; ++step) {
      const auto id = static_cast<ObjectId>(step * 7 % boxes.size());
      const Box gone = {{1, 1, 1}, {-1, -1, -1}};
      ASSERT_EQ(b.move(id, gone), Status::ok);
      ASSERT_TRUE(b.update().ok());
      const List ended = plain(b.ended());
      ASSERT_EQ(b.move(id, boxes[id]), Status::ok);
      ASSERT_TRUE(b.update().ok());
      EXPECT_EQ(plain(b.begun()), ended);
      EXPECT_EQ(ended.size(), static_cast<std::size_t>(std::count_if(
                                  all.pairs.begin(), all.pairs.end(),
                                  [&](Pair p) { return p.first == id || p.second == id; })));
    }
    EXPECT_EQ(plain(b.pairs()), all.pairs);
  }
}

// Concurrent first calls are made one at a time; others are refused as busy.
TEST(BroadPhaseCalls, TwoFirstCallsAtOnce) {
  for (int round = 0; round < 500; ++round) {
    BroadPhase b;
    std::atomic<int> ready{0};
    Result results[2];
    ObjectId ids[2] = {7, 7};
    const auto add = [&](int k) {
      ++ready;
      while (ready != 2) std::this_thread::yield();
      results[k] = b.add(BoxList{three[0]}, &ids[k]);
    };
    std::thread other(add, 1);
    add(0);
    other.join();
    std::size_t done = 0;
    for (const Result& r : results) {
      done += r.ok();
      ASSERT_TRUE(r.ok() || r.status == Status::busy) << r.message;
    }
    ASSERT_GE(done, 1u);
    ASSERT_EQ(b.object_count(), done);
    if (done == 2) {
      ASSERT_NE(ids[0], ids[1]);
    }
  }
}

TEST(BroadPhaseCalls, AnExecutorThatRunsNothing) {
  Executor none;
  none.concurrency = 4;
  Options options;
  options.executor = &none;
  BroadPhase b(options);
  EXPECT_EQ(b.add(three, nullptr).status, Status::bad_option);
  Finder finder(options);
  const Result r = finder.find(three);
  EXPECT_EQ(r.status, Status::bad_option);
  EXPECT_NE(std::string(r.message).find("Executor::run"), std::string::npos) << r.message;
}

}  // namespace
}  // namespace throng::tests
