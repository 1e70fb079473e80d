// Many objects are added and removed between two updates, with queries in between, in guarded
// memory: the capacity of all lists suffices for any order of calls.
#include <gtest/gtest.h>

#include <algorithm>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/configs.hpp"
#include "support/guarded_resource.hpp"

namespace throng::tests {
namespace {

struct ChurnCase {
  enum class Place { one, few, anywhere };
  Place place;
  bool is_static;
  std::size_t objects;
};

class ChurnActor : public Actor {
 public:
  ChurnActor(const Options& options, std::uint64_t seed, const ChurnCase& churn)
      : Actor(options, seed, side), churn_(churn) {}

  static constexpr float side = 30;

  Box next_box() {
    switch (churn_.place) {
      case ChurnCase::Place::one:
        return cube(3, 4, 5, 1);
      case ChurnCase::Place::few:
        return cube(static_cast<float>(random.below(3)), 4, 5, 1);
      default:
        return cube(random.point(0, side), 1);
    }
  }
  testing::AssertionResult place(std::size_t count) {
    Filter filter;
    filter.is_static = churn_.is_static;
    BoxList boxes;
    for (std::size_t i = 0; i < count; ++i) boxes.push_back(next_box());
    Boxes view = boxes;
    view.filters.is_static = {&filter.is_static, count, 0};
    if (count == 0) return testing::AssertionSuccess();
    std::vector<ObjectId> ids(count);
    const Result r = broad_phase.add(view, ids.data());
    if (!r.ok()) return testing::AssertionFailure() << r.message;
    for (std::size_t i = 0; i < count; ++i)
      if (testing::AssertionResult a = model.add(ids[i], boxes[i], filter); !a) return a;
    return model.check_call(r);
  }
  // The oldest, the newest, or any.
  testing::AssertionResult take_away(std::size_t count) {
    std::vector<ObjectId> ids = model.ids();
    const std::uint32_t which = random.below(3);
    if (which == 1) std::reverse(ids.begin(), ids.end());
    if (which == 2) shuffle(ids, random);
    ids.resize(std::min(count, ids.size()));
    for (const ObjectId id : ids) model.remove(id);
    return model.check_call(broad_phase.remove(ids.data(), ids.size()));
  }
  testing::AssertionResult check_queries() {
    BoxList boxes;
    std::vector<Sweep> sweeps;
    for (int k = 0; k < 3; ++k) {
      boxes.push_back(next_box());
      sweeps.push_back({next_box(), random.point(-2, 2)});
    }
    const std::vector<Filter> filters(boxes.size());
    if (testing::AssertionResult r = same_overlaps(broad_phase, model, boxes, filters, true); !r)
      return r;
    return same_hits(broad_phase, model, sweeps, filters);
  }
  // A few updates in which one object moves back and forth: few changes, so cells pay off.
  testing::AssertionResult few_move() {
    for (int k = 0; k < 6; ++k) {
      const std::vector<ObjectId> ids = model.ids();
      if (ids.empty()) return testing::AssertionSuccess();
      const ObjectId id = ids[random.below(static_cast<std::uint32_t>(ids.size()))];
      model.at(id).box = k % 2 ? next_box() : cube(-100, 0, 0, 1);
      if (testing::AssertionResult r =
              model.check_call(broad_phase.move(&id, Boxes(&model.at(id).box, 1)));
          !r)
        return r;
      if (testing::AssertionResult r = update(false); !r) return r;
    }
    return testing::AssertionSuccess();
  }

 private:
  ChurnCase churn_;
};

class BroadPhaseChurn : public testing::TestWithParam<ChurnCase> {};

TEST_P(BroadPhaseChurn, StaysWithinItsCapacity) {
  const ChurnCase& churn = GetParam();
  for (std::uint64_t seed = 0; seed < seeds(3); ++seed) {
    GuardedResource memory;
    Options options;
    options.memory = &memory;
    options.threads = 1 + seed % 2;
    if (thread_sanitized && options.threads == 1) continue;
    ChurnActor actor(options, seed, churn);
    Random& random = actor.random;
    ASSERT_TRUE(actor.place(churn.objects));
    ASSERT_TRUE(actor.update());
    ASSERT_TRUE(actor.few_move());
    for (int round = 0; round < 10; ++round) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
      for (std::uint32_t calls = 1 + random.below(3); calls > 0; --calls) {
        const auto many = static_cast<std::size_t>(
            random.below(static_cast<std::uint32_t>(churn.objects * 3 / 4)));
        const std::size_t now = actor.model.count();
        if (now < 2 * churn.objects) {
          ASSERT_TRUE(actor.place(many));
        }
        if (now > many) {
          ASSERT_TRUE(
              actor.take_away(std::max(many, now > churn.objects ? now - churn.objects : 0)));
        }
      }
      if (!random.one_in(4)) {
        ASSERT_TRUE(actor.check_queries());
        ASSERT_TRUE(memory.check());
      }
      if (random.one_in(2)) {
        ASSERT_TRUE(actor.update());
        ASSERT_TRUE(memory.check());
      }
      if (random.one_in(3)) {
        BroadPhase copy = actor.broad_phase;
        std::swap(copy, actor.broad_phase);
      }
      if (random.one_in(2)) {
        ASSERT_TRUE(actor.few_move());
        ASSERT_TRUE(memory.check());
      }
    }
    EXPECT_GT(memory.allocations(), 10u) << "the memory resource is not used";
  }
}

std::string name_of(const testing::TestParamInfo<ChurnCase>& info) {
  constexpr const char* places[] = {"one_place", "few_places", "anywhere"};
  return std::string(places[static_cast<int>(info.param.place)]) +
         (info.param.is_static ? "_static_" : "_moving_") + std::to_string(info.param.objects);
}

constexpr ChurnCase churns[] = {
    {ChurnCase::Place::one, true, 1200},      {ChurnCase::Place::few, true, 700},
    {ChurnCase::Place::anywhere, true, 1000}, {ChurnCase::Place::anywhere, false, 600},
    {ChurnCase::Place::few, false, 60},       {ChurnCase::Place::one, true, 40},
};
INSTANTIATE_TEST_SUITE_P(All, BroadPhaseChurn, testing::ValuesIn(churns), name_of);

}  // namespace
}  // namespace throng::tests
