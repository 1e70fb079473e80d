// The pairs are the same for any floating-point state of the calling thread, and the call restores
// that state.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"
#include "support/modified_float_state.hpp"

namespace throng::tests {
namespace {

class FloatState : public Conformance {};

TEST_P(FloatState, AnyRoundingAnyFlushing) {
  struct Case {
    HardScene scene;
    float margin;
    Answer answer, two;
  };
  static std::vector<Case> cases;
  if (cases.empty()) {
    for (HardScene& scene : hard_scenes(200)) {
      const float margin = cases.size() % 3 == 0   ? 0.1f
                           : cases.size() % 3 == 1 ? denormal * 3
                                                   : 0.0f;
      Answer answer = reference_pairs(scene.boxes, margin);
      const std::size_t half = scene.boxes.size() / 2;
      Answer two = reference_pairs(Boxes(scene.boxes.data(), half), scene.boxes, margin);
      cases.push_back({std::move(scene), margin, std::move(answer), std::move(two)});
    }
  }
  for (const int rounding : {FE_DOWNWARD, FE_UPWARD, FE_TOWARDZERO, FE_TONEAREST}) {
    for (const bool flush : {true, false}) {
      for (const Case& c : cases) {
        SCOPED_TRACE(c.scene.name + " rounding " + std::to_string(rounding) + " flush " +
                     std::to_string(flush));
        Options with = options();
        with.margin = c.margin;
        Finder finder(with);
        const Boxes half(c.scene.boxes.data(), c.scene.boxes.size() / 2);
        std::vector<Pair> one, two;
        Result first, second;
        bool unchanged = false;
        {
          const ModifiedFloatState state(rounding, flush);
          first = finder.find(c.scene.boxes);
          unchanged = state.unchanged();
          one = to_vector(finder.pairs());
          second = finder.find(half, c.scene.boxes);
          unchanged = unchanged && state.unchanged();
          two = to_vector(finder.pairs());
        }
        EXPECT_TRUE(unchanged) << "the caller's state was changed";
        expect_pairs(first, config(), c.answer, one, 0);
        expect_pairs(second, config(), c.two, two, 0);
      }
    }
  }
}

// Through errors, through a consumer that throws, and through round_outward as well.
TEST_P(FloatState, RestoredOnEveryExit) {
  BoxList good = uniform_boxes(300, 1), bad = good;
  bad[3].lower.x = std::numeric_limits<float>::quiet_NaN();
  Finder finder(options());
  const auto stop = [](const Pair*, std::size_t) { return false; };
  const auto raise = [](const Pair*, std::size_t) -> bool { throw 1; };
  int thrown = 0, unchanged = 0;
  Box outward{};
  for (const int rounding : {FE_DOWNWARD, FE_UPWARD, FE_TOWARDZERO}) {
    const ModifiedFloatState state(rounding, true);
    (void)finder.find(bad);
    unchanged += state.unchanged();
    (void)finder.find(good, nullptr, 0);
    unchanged += state.unchanged();
    (void)finder.consume(good, stop);
    unchanged += state.unchanged();
    try {
      (void)finder.consume(good, raise);
    } catch (int) {
      ++thrown;
    }
    unchanged += state.unchanged();
    const double v[3] = {1e-42, -1e-42, 0.1};
    outward = round_outward(v, v);
    unchanged += state.unchanged();
  }
  EXPECT_EQ(thrown, 3);
  EXPECT_EQ(unchanged, 15);
  const double v[3] = {1e-42, -1e-42, 0.1};
  const Box want = round_outward(v, v);
  EXPECT_EQ(std::memcmp(&outward, &want, sizeof want), 0)
      << "rounding outward depends on the state";
}

THRONG_INSTANTIATE(FloatState, suite_configs);

}  // namespace
}  // namespace throng::tests
