// Incremental state between updates, and few objects left of many, against the model.
#include <gtest/gtest.h>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {
namespace {

using QueryActor = ActorOf<BroadPhase>;

testing::AssertionResult check_queries(QueryActor& actor) {
  BoxList boxes;
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 3; ++k) boxes.push_back(actor.any_box()), sweeps.push_back(actor.any_sweep());
  const std::vector<Filter> filters(boxes.size());
  if (testing::AssertionResult r =
          same_overlaps(actor.broad_phase, actor.model, boxes, filters, false);
      !r)
    return r;
  return same_hits(actor.broad_phase, actor.model, sweeps, filters);
}

// Each step changes objects, some of them often, and runs queries; updates are rare.
TEST(Sparse, QueriesBetweenChanges) {
  for (std::uint64_t seed = 1; seed <= seeds(8); ++seed) {
    Options options;
    options.threads = 1;
    options.margin = seed % 3 == 0 ? 0.125f : 0;
    QueryActor actor(options, seed, 14);
    ASSERT_TRUE(actor.add(500, seed % 2 == 0));
    ASSERT_TRUE(actor.update());
    const std::vector<ObjectId> few = actor.some_ids(5);
    for (int step = 0; step < 160; ++step) {
      switch (step % 8) {
        case 0:
          ASSERT_TRUE(actor.add(2, true));
          break;
        case 1:
          ASSERT_TRUE(actor.remove(2));
          break;
        case 2:
          ASSERT_TRUE(actor.move(30));
          break;
        case 3:
          if (step % 32 == 3) {
            ASSERT_TRUE(actor.move_all(40));
          }
          break;
        default:
          // More changes than there are changed objects, too.
          for (int k = 0; k < (step % 40 == 4 ? 1500 : 3); ++k) {
            const ObjectId id = few[actor.random.below(5)];
            if (!actor.model.alive(id)) continue;
            const Box box = actor.any_box();
            ASSERT_EQ(actor.broad_phase.move(id, box), Status::ok);
            actor.model.at(id).box = box;
          }
      }
      ASSERT_TRUE(check_queries(actor)) << "seed " << seed << " step " << step;
      if (step % 50 == 49) {
        ASSERT_TRUE(actor.update()) << "seed " << seed << " step " << step;
      }
    }
    ASSERT_TRUE(actor.update());
  }
}

// Few of many objects are left, with scattered ids, in every kind of update.
TEST(Sparse, FewAreLeftOfMany) {
  for (const bool filtered : {false, true}) {
    Options options;
    options.threads = 2;
    QueryActor actor(options, 7, 20);
    ASSERT_TRUE(actor.add(sanitized ? 2500 : 6000, filtered));
    ASSERT_TRUE(actor.update());
    ASSERT_TRUE(actor.remove(actor.model.count() - 300));
    BroadPhase snapshot;
    Model model_then;
    for (int step = 0; step < 30; ++step) {
      ASSERT_TRUE(actor.update()) << "step " << step;
      if (step == 12) {
        snapshot = actor.broad_phase;
        model_then = actor.model;
      }
      if (step == 10 || step == 13) {
        ASSERT_TRUE(actor.add(40, filtered));
      }
      if (step == 15) {
        ASSERT_TRUE(actor.remove(60));
      }
      if (step == 20) {
        actor.broad_phase = snapshot;
        actor.model = model_then;
      }
      ASSERT_TRUE(actor.move(step % 3 == 0 ? 5 : 400));
      ASSERT_TRUE(check_queries(actor)) << "step " << step;
    }
    // And many again.
    ASSERT_TRUE(actor.add(1500, filtered));
    ASSERT_TRUE(actor.update());
    ASSERT_TRUE(check_queries(actor));
  }
}

// Objects of world -1 with few worlds, which are searched one by one, and with more than are
// listed; worlds appear and disappear.
TEST(Sparse, FewWorldsAndMany) {
  for (const int worlds : {1, 5, 33, 60}) {
    Options options;
    options.threads = 1;
    QueryActor actor(options, static_cast<std::uint64_t>(worlds), 9);
    Random random(3);
    const auto add = [&](int from, int to, int count) {
      for (int k = 0; k < count; ++k) {
        const Box box = actor.any_box();
        Filter filter;
        filter.world = random.one_in(4) ? -1 : random.between(from, to);
        ObjectId id = 0;
        ASSERT_EQ(actor.broad_phase.add(box, filter, id), Status::ok);
        ASSERT_TRUE(actor.model.add(id, box, filter));
      }
    };
    add(0, worlds - 1, 500);
    ASSERT_TRUE(actor.update());
    for (int step = 0; step < 25; ++step) {
      ASSERT_TRUE(actor.move(6));
      if (step % 5 == 1) {
        ASSERT_TRUE(actor.remove(step == 16 ? 450 : 20));
      }
      if (step % 5 == 2) add(step % 2 ? 0 : worlds, step % 2 ? worlds / 2 : 2 * worlds, 30);
      ASSERT_TRUE(check_queries(actor)) << worlds << " worlds, step " << step;
      ASSERT_TRUE(actor.update()) << worlds << " worlds, step " << step;
    }
  }
}

}  // namespace
}  // namespace throng::tests
