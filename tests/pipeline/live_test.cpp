// Objects that live on a device, run by the host: long random lives against the model, and byte for
// byte against throng::BroadPhase.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "broad_phase/actor.hpp"
#include "pipeline/live_machine.hpp"

namespace throng::tests {
namespace {

using LiveActor = ActorOf<LiveMachine>;

// Few move a little for a while, then many by far: fat boxes hold, and do not.
void live(const Options& options, float fat_margin, std::uint64_t seed, std::size_t objects,
          float side, bool filtered, std::size_t steps) {
  LiveActor actor(options, seed, side, fat_margin);
  Random& random = actor.random;
  ASSERT_TRUE(actor.add(objects, filtered));
  ASSERT_TRUE(actor.update());
  for (std::size_t step = 0; step < steps; ++step) {
    const bool calm = step / 24 % 3 != 2;
    const std::size_t few = calm ? 1 + random.below(4) : 1 + random.below(400);
    for (std::uint32_t k = random.below(3); k-- > 0;) {
      switch (random.below(calm ? 12 : 8)) {
        case 0:
          if (actor.model.count() < 2 * objects) {
            ASSERT_TRUE(actor.add(few, filtered));
          }
          break;
        case 1:
          ASSERT_TRUE(actor.remove(random.one_in(40) ? objects / 2 : few));
          break;
        case 2:
          if (filtered) {
            ASSERT_TRUE(actor.set_filters(few));
          }
          break;
        default:
          ASSERT_TRUE(actor.move(few));
          break;
      }
    }
    // Nothing may come between boxes that are kept back and their update.
    actor.broad_phase.move_at_once(random.one_in(2));
    if (random.one_in(2)) {
      ASSERT_TRUE(actor.move_all(calm ? 300 : 2));
    }
    ASSERT_TRUE(actor.update(random.one_in(2))) << "step " << step << " seed " << seed;
  }
}

TEST(LiveScene, Plain) {
  for (std::uint64_t seed = 0; seed < 6; ++seed)
    live({}, seed % 2 ? 0.0f : 1.0f, seed, 250, 12, false, 100);
}
TEST(LiveScene, Filtered) {
  for (std::uint64_t seed = 0; seed < 6; ++seed)
    live({}, seed % 2 ? 0.0f : 1.0f, seed, 200, 8, true, 100);
}
TEST(LiveScene, MarginAndGrid) {
  Options options;
  options.margin = 0.1f;
  options.algorithm = Algorithm::grid;
  for (std::uint64_t seed = 0; seed < 4; ++seed) live(options, 0.7f, seed, 200, 8, seed % 2, 80);
}

}  // namespace
}  // namespace throng::tests
