// Objects that live on a device, run by the host: long random lives against the model, and byte for
// byte against throng::BroadPhase.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "broad_phase/actor.hpp"
#include "pipeline/live_machine.hpp"
#include "support/counting.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

using LiveActor = ActorOf<LiveMachine>;
constexpr ObjectId no_id = 0xffffffffu;

// How many updates went which way.
struct Ways {
  std::size_t nothing = 0, compared = 0, mended = 0, found = 0;
  void count(const std::string& reason) {
    nothing += reason == "nothing moved";
    compared += reason.find("compared again") != std::string::npos;
    mended += reason.find("few boxes left") == 0;
    found += reason.find("all candidates found") == 0;
  }
};

// Few move a little for a while, then many by far: fat boxes hold, and do not.
void live(const Options& options, float fat_margin, std::uint64_t seed, std::size_t objects,
          float side, bool filtered, std::size_t steps, Ways* ways = nullptr) {
  LiveActor actor(options, seed, side, fat_margin);
  actor.in_worlds = options.algorithm != Algorithm::grid;
  Random& random = actor.random;
  ASSERT_TRUE(actor.add(objects, filtered));
  ASSERT_TRUE(actor.update());
  for (std::size_t step = 0; step < steps; ++step) {
    const bool calm = step / 24 % 3 != 2;
    ASSERT_TRUE(actor.some_calls(calm, objects, filtered, false));
    // Nothing may come between boxes that are kept back and their update.
    actor.broad_phase.move_at_once(random.one_in(2));
    if (random.one_in(2)) {
      ASSERT_TRUE(actor.move_all(calm ? 300 : 2));
    }
    ASSERT_TRUE(actor.update(random.one_in(2))) << "step " << step << " seed " << seed;
    if (ways) ways->count(actor.broad_phase.last_reason());
  }
}

TEST(LiveScene, Plain) {
  for (std::uint64_t seed = 0; seed < 3; ++seed)
    live({}, seed % 2 ? 0.0f : 1.0f, seed, 250, 12, false, 100);
}
TEST(LiveScene, Filtered) {
  for (std::uint64_t seed = 0; seed < 4; ++seed)
    live({}, seed % 2 ? 0.0f : 1.0f, seed, 200, 8, true, 100);
}
// In a grid few that leave their fat boxes have their candidates mended; without worlds.
TEST(LiveScene, Grid) {
  Ways ways;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Options options;
    options.algorithm = Algorithm::grid;
    options.margin = seed % 3 == 2 ? 0.1f : 0.0f;
    live(options, 0.7f, seed, 250, 8, seed % 2, 120, &ways);
  }
  EXPECT_GT(ways.compared, 100u);
  EXPECT_GT(ways.mended, 100u);
  EXPECT_GT(ways.found, 100u);
}

// ---- against throng::BroadPhase -----------------------------------------------------------------

bool same_bytes(const LivePairs& a, const LivePairs& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(LivePair)) == 0);
}

// Both at once; a call fails where they answer differently.
class Twins {
 public:
  Twins(const Options& options, float fat_margin) : device_(options, fat_margin), host_(options) {}

  Result add(const Boxes& boxes, ObjectId* ids) {
    std::vector<ObjectId> other(boxes.size());
    const Result r = both([&](auto& b) {
      using Machine = std::decay_t<decltype(b)>;
      return b.add(boxes, std::is_same_v<Machine, BroadPhase> ? other.data() : ids);
    });
    EXPECT_TRUE(std::equal(other.begin(), other.end(), ids)) << "other ids";
    return r;
  }
  Result remove(const ObjectId* ids, std::size_t n) {
    return both([&](auto& b) { return b.remove(ids, n); });
  }
  Result move(const ObjectId* ids, const Boxes& boxes) {
    return both([&](auto& b) { return b.move(ids, boxes); });
  }
  Result move_all(const Boxes& boxes) {
    return both([&](auto& b) { return b.move_all(boxes); });
  }
  Result set_filters(const ObjectId* ids, std::size_t n, const Filters& filters) {
    return both([&](auto& b) { return b.set_filters(ids, n, filters); });
  }
  Result shift_origin(const Vec3& by) {
    return both([&](auto& b) { return b.shift_origin(by); });
  }
  Result update() {
    const Result r = both([&](auto& b) { return b.update(); });
    EXPECT_TRUE(same_bytes(device_.begun(), host_.begun()));
    EXPECT_TRUE(same_bytes(device_.ended(), host_.ended()));
    EXPECT_TRUE(same_bytes(device_.pairs(), host_.pairs()));
    EXPECT_EQ(device_.slot_limit(), host_.slot_limit());
    return r;
  }
  LivePairs begun() const { return device_.begun(); }
  LivePairs ended() const { return device_.ended(); }
  LivePairs pairs() { return device_.pairs(); }
  std::uint64_t object_count() const { return device_.object_count(); }
  std::uint64_t id_limit() const { return device_.id_limit(); }
  std::uint64_t pair_count() const { return device_.pair_count(); }
  std::uint64_t slot_limit() const { return device_.slot_limit(); }

 private:
  template <class F>
  Result both(const F& f) {
    const Result want = f(host_), got = f(device_);
    EXPECT_EQ(want.status, got.status);
    EXPECT_EQ(want.found, got.found);
    EXPECT_EQ(want.first_invalid, got.first_invalid);
    EXPECT_EQ(want.invalid_count, got.invalid_count);
    return got;
  }
  LiveMachine device_;
  BroadPhase host_;
};

TEST(LiveScene, SameBytesAsTheBroadPhase) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Options options;
    options.threads = 1;
    options.margin = seed == 3 ? 0.05f : 0.0f;
    options.algorithm = seed < 2 ? Algorithm::grid : Algorithm::automatic;
    ActorOf<Twins> actor(options, seed, 9, 0.6f);
    actor.in_worlds = seed >= 2;
    Random& random = actor.random;
    ASSERT_TRUE(actor.add(200, seed % 2));
    for (int step = 0; step < 60; ++step) {
      ASSERT_TRUE(actor.move(1 + random.below(step % 3 ? 5 : 200)));
      if (step % 5 == 0) {
        ASSERT_TRUE(actor.add(random.below(20), seed % 2));
      }
      if (step % 7 == 0) {
        ASSERT_TRUE(actor.remove(random.below(30)));
      }
      if (seed % 2 && step % 6 == 0) {
        ASSERT_TRUE(actor.set_filters(5));
      }
      if (step % 9 == 0) {
        ASSERT_TRUE(actor.move_all(4));
      }
      if (step == 40) {
        const Vec3 by = {1000.3f, -7, 0.1f};
        ASSERT_TRUE(actor.broad_phase.shift_origin(by).ok());
        for (ObjectId id : actor.model.ids()) {
          Box& b = actor.model.at(id).box;
          b.lower = {b.lower.x + by.x, b.lower.y + by.y, b.lower.z + by.z};
          b.upper = {b.upper.x + by.x, b.upper.y + by.y, b.upper.z + by.z};
        }
      }
      ASSERT_TRUE(actor.update()) << "step " << step << " seed " << seed;
      ASSERT_FALSE(testing::Test::HasFailure()) << "step " << step << " seed " << seed;
    }
  }
}

// ---- what is refused ----------------------------------------------------------------------------

// All that can be seen.
std::vector<LivePair> seen(LiveMachine& m) {
  std::vector<LivePair> all;
  for (const LivePairs& list : {m.begun(), m.ended(), m.pairs()}) {
    all.insert(all.end(), list.begin(), list.end());
    all.push_back({no_id, no_id, static_cast<std::uint32_t>(list.size())});
  }
  all.push_back({static_cast<ObjectId>(m.object_count()), static_cast<ObjectId>(m.id_limit()),
                 static_cast<std::uint32_t>(m.slot_limit())});
  return all;
}
bool same(const std::vector<LivePair>& a, const std::vector<LivePair>& b) {
  return same_bytes({a.data(), a.size()}, {b.data(), b.size()});
}

TEST(LiveScene, WhatIsRefusedChangesNothing) {
  LiveActor actor({}, 1, 6, 0.5f);
  LiveMachine& m = actor.broad_phase;
  ASSERT_TRUE(actor.add(300, true));
  ASSERT_TRUE(actor.remove(5));
  ASSERT_TRUE(actor.update());
  const std::vector<LivePair> before = seen(m);
  const auto refused = [&](const Result& r, Status status, std::uint64_t first,
                           std::uint64_t count) {
    EXPECT_EQ(r.status, status) << to_string(r.status);
    EXPECT_EQ(r.first_invalid, first);
    EXPECT_EQ(r.invalid_count, count);
    EXPECT_TRUE(same(seen(m), before));
  };
  const std::vector<ObjectId> alive = actor.model.ids();
  ObjectId dead = 0;
  while (actor.model.alive(dead)) ++dead;
  const float nan = std::nanf("");
  BoxList boxes(6, cube(0, 0, 0, 1));
  const std::vector<ObjectId> twice = {alive[0], alive[1], alive[2], alive[1], alive[1], alive[3]};
  refused(m.move(twice.data(), boxes), Status::bad_id, 3, 2);
  const std::vector<ObjectId> gone = {alive[0], alive[1], dead, 300, 0xffffffffu, alive[3]};
  refused(m.remove(gone.data(), gone.size()), Status::bad_id, 2, 3);
  boxes[4].upper.y = nan;
  boxes[5].lower.z = nan;
  refused(m.move(alive.data(), boxes), Status::nan_box, 4, 2);
  refused(m.add(boxes, nullptr), Status::nan_box, 4, 2);
  const std::vector<std::int32_t> worlds = {0, 1, -1, -2, 5, -3};
  Filters filters;
  filters.world = {worlds.data(), worlds.size()};
  refused(m.set_filters(alive.data(), 6, filters), Status::bad_filter, 3, 2);
  Boxes in_worlds(boxes.data(), 6);
  in_worlds.filters = filters;
  refused(m.add(in_worlds, nullptr), Status::bad_filter, 3, 2);
  std::vector<ObjectId> many(alive.size() + 1, alive[0]);
  refused(m.remove(many.data(), many.size()), Status::bad_id, 0, many.size());

  // Of all at once, by itself and together with an update; ids that are not alive do not count.
  BoxList all(m.id_limit(), Box{{nan, 0, 0}, {1, 1, 1}});
  for (const ObjectId id : alive) all[id] = actor.moved(actor.model.at(id).box);
  all[alive[7]].lower.x = nan;
  for (const bool at_once : {false, true}) {
    m.move_at_once(at_once);
    Result r = m.move_all(all);
    if (at_once) r = m.update();
    refused(r, Status::nan_box, alive[7], 1);
  }
  // Nothing of it has been taken.
  m.move_at_once(false);
  ASSERT_TRUE(actor.move(3));
  ASSERT_TRUE(actor.update());
  // Where a NaN is allowed it overlaps nothing.
  Options lax;
  lax.nan = NanPolicy::inactive;
  LiveActor other(lax, 2, 5, 0.5f);
  ASSERT_TRUE(other.add(100, false));
  ASSERT_TRUE(other.update());
  for (int k = 0; k < 20; ++k) {
    const ObjectId id = other.some_ids(1)[0];
    Box& box = other.model.at(id).box;
    box = k % 2 ? other.any_box() : Box{{0, 0, 0}, {1, 1, nan}};
    ASSERT_TRUE(other.broad_phase.move(&id, Boxes(&box, 1)).ok());
    ASSERT_TRUE(other.update());
  }
}

// ---- fat boxes ----------------------------------------------------------------------------------

TEST(LiveScene, CostFollowsTheMovers) {
  Options options;
  options.algorithm = Algorithm::grid;
  LiveMachine m(options, 0.25f);
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
  update("all candidates found");
  const std::uint64_t candidates = m.scene().pairs().candidate_count();
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
  EXPECT_EQ(m.scene().pairs().candidate_count(), candidates);
  shift(17, 0.2f);
  ASSERT_TRUE(m.move_all(boxes).ok());
  EXPECT_LT(update("few boxes left").comparisons, 100u);
  for (std::size_t id = 0; id < boxes.size(); id += 2) shift(id, 0.2f);
  ASSERT_TRUE(m.move_all(boxes).ok());
  update("all candidates found");
  // What is gone takes its pairs with it, and nothing is found anew for that.
  std::vector<ObjectId> ids;
  for (ObjectId id = 0; id < 3000; id += 2) ids.push_back(id), model.remove(id);
  ASSERT_TRUE(m.remove(ids.data(), ids.size()).ok());
  update("compared again");
}

// More begins and ends at once than room was made for.
TEST(LiveScene, ManyChangesAtOnce) {
  LiveMachine m({}, 1);
  BoxList boxes;
  for (int k = 0; k < 3000; ++k) {
    const float x = 10.0f * static_cast<float>(k);
    boxes.push_back(cube(x, 0, 0, 1));
    boxes.push_back(cube(x + 1.5f, 0, 0, 1));
  }
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  ASSERT_TRUE(m.update().ok());
  EXPECT_EQ(m.pair_count(), 0u);
  ASSERT_EQ(m.scene().pairs().candidate_count(), 3000u);
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

// ---- memory -------------------------------------------------------------------------------------

// Refuses all requests but the first few.
class StingyResource : public CountingResource {
 public:
  void allow(std::size_t requests) { left_ = requests; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (left_ == 0) throw std::bad_alloc();
    if (left_ != everything) --left_;
    return CountingResource::do_allocate(bytes, alignment);
  }
  static constexpr std::size_t everything = static_cast<std::size_t>(-1);
  std::size_t left_ = everything;
};

// With one allocation more each time until it works; what can be seen stays until then.
template <class Act>
std::size_t until_it_works(StingyResource& memory, LiveMachine& m, const Act& act) {
  const std::vector<LivePair> before = seen(m);
  for (std::size_t allowed = 0;; ++allowed) {
    memory.allow(allowed);
    const Result r = act();
    memory.allow(static_cast<std::size_t>(-1));
    if (r.ok()) return allowed;
    EXPECT_EQ(r.status, Status::out_of_memory);
    EXPECT_NE(r.bytes_needed, 0u);
    EXPECT_TRUE(same(seen(m), before)) << "after " << allowed << " allocations";
    if (testing::Test::HasFailure() || allowed > 1000) return allowed;
  }
}

TEST(LiveScene, MemoryRunsOutAtEveryAllocation) {
  StingyResource memory;
  std::pmr::memory_resource* resource = &memory;
  Options options;
  options.algorithm = Algorithm::grid;
  LiveActor actor(options, 3, 14, 0.3f, resource);
  actor.in_worlds = false;
  LiveMachine& m = actor.broad_phase;
  std::size_t in_objects = 0, in_updates = 0;
  Ways ways;
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
      in_objects += until_it_works(memory, m, [&] { return m.add(view, ids.data()); });
      for (std::size_t i = 0; i < ids.size(); ++i)
        ASSERT_TRUE(actor.model.add(ids[i], boxes[i], filters[i]));
    }
    if (step % 5 == 3) {
      const std::vector<ObjectId> ids = actor.some_ids(3);
      in_objects += until_it_works(memory, m, [&] { return m.remove(ids.data(), ids.size()); });
      for (const ObjectId id : ids) actor.model.remove(id);
    }
    m.move_at_once(step % 3 == 0);
    ASSERT_TRUE(actor.move_all(step % 6 < 2 ? 2 : 50));
    in_updates += until_it_works(memory, m, [&] {
      const Result r = m.update();
      if (!r.ok()) ways.count(r.plan.reason);
      return r;
    });
    actor.model.update();
    ASSERT_TRUE(actor.model.check(m)) << "step " << step;
  }
  EXPECT_GT(in_objects, 12u);
  EXPECT_GT(in_updates, 20u);
  EXPECT_GT(ways.mended, 2u) << "no failure while candidates were mended";
  LiveMachine copy({}, 0.3f, &memory);
  ASSERT_TRUE(copy.add(BoxList{cube(0, 0, 0, 1), cube(0, 0, 0, 2)}, nullptr).ok());
  ASSERT_TRUE(copy.update().ok());
  EXPECT_GT(until_it_works(memory, copy, [&] { return copy.copy_from(m); }), 3u);
  EXPECT_TRUE(same(seen(copy), seen(m)));
}

// Warm updates take nothing, and memory is so much an object and a candidate.
TEST(LiveScene, MemoryIsObjectsAndPairs) {
  CountingResource memory;
  {
    LiveMachine m({}, 0.1f, &memory);
    BoxList boxes = uniform_boxes(20000, 1);
    ASSERT_TRUE(m.add(boxes, nullptr).ok());
    ASSERT_TRUE(m.update().ok());
    const std::uint64_t candidates = m.scene().pairs().candidate_count();
    EXPECT_LT(memory.peak(), 130 * boxes.size() + 90 * candidates + 400000);
    std::size_t warm = 0;
    for (int frame = 0; frame < 12; ++frame) {
      if (frame == 6) warm = memory.allocations();
      // Some stay within their fat boxes, and each third time nobody does.
      for (Box& b : boxes) {
        const float by = frame % 3 ? 0.02f : frame % 2 ? 0.4f : -0.4f;
        b.lower.y += by, b.upper.y += by;
      }
      ASSERT_TRUE(m.move_all(boxes).ok());
      ASSERT_TRUE(m.update().ok());
      (void)m.pairs();
    }
    EXPECT_EQ(memory.allocations(), warm);
    EXPECT_EQ(m.scene().held(), memory.held());
  }
  EXPECT_EQ(memory.held(), 0u);
}

// A copy goes its own way; rolled back, the same calls tell the same, slots and ids included.
TEST(LiveScene, SnapshotAndRollback) {
  Options options;
  options.algorithm = Algorithm::grid;
  LiveActor actor(options, 4, 8, 0.5f);
  actor.in_worlds = false;
  LiveMachine& m = actor.broad_phase;
  ASSERT_TRUE(actor.add(200, true));
  ASSERT_TRUE(actor.update());
  ASSERT_TRUE(actor.remove(20));
  ASSERT_TRUE(actor.update());
  ASSERT_TRUE(actor.move(5));  // what has not been told is part of it
  ASSERT_TRUE(actor.remove(2));
  LiveMachine saved(Options{}, 0);
  ASSERT_TRUE(saved.copy_from(m).ok());
  const Model model = actor.model;
  const Random random = actor.random;
  std::vector<std::vector<LivePair>> first;
  for (int round = 0; round < 2; ++round) {
    for (int k = 0; k < 20; ++k) {
      // At first so few that candidates are mended: not in the grid of what was rolled back.
      ASSERT_TRUE(actor.move(1 + actor.random.below(k % 3 != 2 ? 3 : 200)));
      if (k % 5 == 4) {
        ASSERT_TRUE(actor.add(3, true));
      }
      if (k % 7 == 0) {
        ASSERT_TRUE(actor.remove(4));
      }
      ASSERT_TRUE(actor.update());
      if (round == 0)
        first.push_back(seen(m));
      else
        ASSERT_TRUE(same(seen(m), first[static_cast<std::size_t>(k)])) << k;
    }
    ASSERT_TRUE(m.copy_from(saved).ok());
    actor.model = model;
    actor.random = random;
  }
}

}  // namespace
}  // namespace throng::tests
