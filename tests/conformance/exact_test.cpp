// The main guarantee: exactly the pairs of a double loop, for every algorithm, instruction set,
// number of threads and order.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Exact : public Conformance {};

struct Solved {
  HardScene scene;
  Answer answer;
};

// The double loop, run once for all configurations.
const std::vector<Solved>& solved_scenes(int n) {
  static std::vector<Solved> small, large;
  std::vector<Solved>& solved = n < 1000 ? small : large;
  if (solved.empty()) {
    for (HardScene& scene : hard_scenes(n)) {
      Answer answer = reference_pairs(scene.boxes);
      solved.push_back({std::move(scene), std::move(answer)});
    }
  }
  return solved;
}

// Around the widths of vectors, tiles and blocks.
TEST_P(Exact, Counts) {
  static std::vector<Solved> solved;
  if (solved.empty()) {
    for (const int n : {1,  2,  3,  7,   8,   15,  16,  17,  31,  32,   33,
                        63, 64, 65, 127, 129, 255, 256, 257, 511, 1023, 4097}) {
      HardScene scene = {"uniform " + std::to_string(n),
                         uniform_boxes(n, static_cast<std::uint64_t>(n))};
      solved.push_back({scene, reference_pairs(scene.boxes)});
      scene = {"identical " + std::to_string(n), identical_boxes(n > 300 ? 300 : n, 1)};
      solved.push_back({scene, reference_pairs(scene.boxes)});
      scene = {"points " + std::to_string(n), points(n, 1)};
      solved.push_back({scene, reference_pairs(scene.boxes)});
    }
  }
  for (const Solved& s : solved) {
    SCOPED_TRACE(s.scene.name);
    expect_exact(s.scene.boxes, config(), s.answer);
  }
}

TEST_P(Exact, TwentyThousand) {
  static const BoxList boxes = uniform_boxes(20000, 20000);
  static const Answer answer = reference_pairs(boxes);
  ASSERT_GT(answer.pairs.size(), 20000u);
  expect_exact(boxes, config(), answer);
}

// Enough boxes for many columns, and overlapping boxes over most of them: with all pairs, by
// worlds, by static, and in two sets.
TEST_P(Exact, WideAmongMany) {
  static const BoxList boxes = [] {
    BoxList all = uniform_boxes(12000, 31);
    Random random(32);
    for (int k = 0; k < 24; ++k) {
      Box& box = all[random.below(12000)];
      const Vec3 at = random.point(-5, 25);
      box = {at, {at.x + 28, at.y + 28, at.z + 28}};
      if (k % 3 == 1) box.upper.y = box.lower.y;  // a sheet
      if (k % 3 == 2) box.lower.z = -infinity, box.upper.z = infinity;
    }
    return all;
  }();
  static const std::vector<std::int32_t> world = [] {
    std::vector<std::int32_t> all;
    for (std::size_t i = 0; i < 12000; ++i) all.push_back(static_cast<std::int32_t>(i % 4) - 1);
    return all;
  }();
  static const std::vector<std::uint8_t> still = [] {
    std::vector<std::uint8_t> all;
    for (std::size_t i = 0; i < 12000; ++i) all.push_back(i % 5 < 3);
    return all;
  }();
  Boxes plain = boxes, worlds = boxes, statics = boxes;
  worlds.filters.world = {world.data(), world.size()};
  statics.filters.is_static = {still.data(), still.size()};
  const Boxes half(boxes.data(), 6000), rest(boxes.data() + 6000, 6000);
  static const Answer of_plain = reference_pairs(plain), of_worlds = reference_pairs(worlds),
                      of_statics = reference_pairs(statics),
                      of_halves = reference_pairs(half, rest);
  expect_exact(plain, config(), of_plain);
  expect_exact(worlds, config(), of_worlds);
  expect_exact(statics, config(), of_statics);
  expect_exact(half, rest, config(), of_halves);
}

TEST_P(Exact, None) {
  Finder finder(options());
  for (const Boxes& none :
       {Boxes(), Boxes(BoxList{}), Boxes(static_cast<const Box*>(nullptr), 0)}) {
    const Result result = finder.find(none);
    EXPECT_EQ(result.status, Status::ok) << result.message;
    EXPECT_EQ(result.found, 0u);
    EXPECT_EQ(result.written, 0u);
    EXPECT_EQ(finder.pairs().size(), 0u);
    EXPECT_NE(result.plan.reason, nullptr);
  }
}

TEST_P(Exact, HardScenesSmall) {
  for (const Solved& s : solved_scenes(300)) {
    SCOPED_TRACE(s.scene.name);
    expect_exact(s.scene.boxes, config(), s.answer);
  }
}

TEST_P(Exact, HardScenes) {
  for (const Solved& s : solved_scenes(2000)) {
    SCOPED_TRACE(s.scene.name);
    expect_exact(s.scene.boxes, config(), s.answer);
  }
}

// One Finder over several scenes: no state may carry over.
TEST_P(Exact, OneFinderForAll) {
  Finder finder(options());
  const std::vector<Solved>& scenes = solved_scenes(300);
  for (int round = 0; round < 2; ++round) {
    for (const Solved& s : scenes) {
      SCOPED_TRACE(s.scene.name);
      const Result result = finder.find(s.scene.boxes);
      expect_pairs(result, config(), s.answer, to_vector(finder.pairs()), s.scene.boxes.size());
    }
    const Result result = finder.find(Boxes());
    EXPECT_TRUE(result.ok());
    EXPECT_EQ(finder.pairs().size(), 0u);
  }
}

// Each hard scene split in two halves as two sets; then against itself.
TEST_P(Exact, TwoSets) {
  static std::vector<Answer> halves, selves;
  const std::vector<Solved>& scenes = solved_scenes(300);
  if (halves.empty()) {
    for (const Solved& s : scenes) {
      const BoxList& b = s.scene.boxes;
      const std::size_t cut = b.size() / 3;
      halves.push_back(
          reference_pairs(Boxes(b.data(), cut), Boxes(b.data() + cut, b.size() - cut)));
      selves.push_back(reference_pairs(b, b));
    }
  }
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    SCOPED_TRACE(scenes[i].scene.name);
    const BoxList& b = scenes[i].scene.boxes;
    const std::size_t cut = b.size() / 3;
    expect_exact(Boxes(b.data(), cut), Boxes(b.data() + cut, b.size() - cut), config(), halves[i]);
    expect_exact(b, b, config(), selves[i]);
  }
}

TEST_P(Exact, TwoSetsOfVeryDifferentSize) {
  static const BoxList many = uniform_boxes(5000, 3), few = huge_among_small(7, 4);
  static const Answer forward = reference_pairs(few, many), backward = reference_pairs(many, few);
  expect_exact(few, many, config(), forward);
  expect_exact(many, few, config(), backward);
  expect_exact(few, Boxes(), config(), Answer{});
  expect_exact(Boxes(), many, config(), Answer{});
  expect_exact(Boxes(), Boxes(), config(), Answer{});
  EXPECT_GT(forward.pairs.size(), 5000u);
}

// The pairs of permuted boxes are the permuted pairs.
TEST_P(Exact, PermutedInputPermutesPairs) {
  for (const Solved& s : solved_scenes(300)) {
    SCOPED_TRACE(s.scene.name);
    const BoxList& boxes = s.scene.boxes;
    Random random(99);
    std::vector<std::uint32_t> place(boxes.size());
    for (std::uint32_t i = 0; i < place.size(); ++i) place[i] = i;
    shuffle(place, random);
    BoxList moved(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) moved[place[i]] = boxes[i];
    Answer want;
    want.inactive = s.answer.inactive;
    for (const Pair& pair : s.answer.pairs) {
      const std::uint32_t p = place[pair.first], q = place[pair.second];
      want.pairs.push_back({std::min(p, q), std::max(p, q)});
    }
    std::sort(want.pairs.begin(), want.pairs.end());
    expect_exact(moved, config(), want);
  }
}

// Expanding boxes in place keeps every pair.
TEST_P(Exact, ExpandingKeepsPairs) {
  Finder finder(options());
  for (const Solved& s : solved_scenes(300)) {
    SCOPED_TRACE(s.scene.name);
    Random random(7);
    BoxList grown = s.scene.boxes;
    for (Box& box : grown) {
      if (!(box.lower.x <= box.upper.x && box.lower.y <= box.upper.y && box.lower.z <= box.upper.z))
        continue;
      for (int k = 0; k < 3; ++k) {
        float& lower = (&box.lower.x)[k];
        float& upper = (&box.upper.x)[k];
        lower = random.one_in(2) ? nudge(lower, -random.between(0, 2)) : lower - random.unit();
        upper = random.one_in(2) ? nudge(upper, random.between(0, 2)) : upper + random.unit();
      }
    }
    ASSERT_TRUE(finder.find(grown).ok());
    std::vector<Pair> pairs = to_vector(finder.pairs());
    std::sort(pairs.begin(), pairs.end());
    EXPECT_TRUE(
        std::includes(pairs.begin(), pairs.end(), s.answer.pairs.begin(), s.answer.pairs.end()));
  }
}

TEST_P(Exact, Margins) {
  const float margins[] = {denormal, 1e-30f, 0.001f, 0.1f, 0.25f, 1.0f, 3e6f, 1e30f, float_max};
  static std::vector<Answer> answers;
  static std::vector<HardScene> scenes;
  if (answers.empty()) {
    scenes = hard_scenes(90);
    for (const HardScene& scene : scenes)
      for (const float margin : margins) answers.push_back(reference_pairs(scene.boxes, margin));
  }
  std::size_t next = 0;
  for (const HardScene& scene : scenes) {
    for (const float margin : margins) {
      SCOPED_TRACE(scene.name + " margin " + std::to_string(margin));
      Options with = options();
      with.margin = margin;
      Finder finder(with);
      const Result result = finder.find(scene.boxes);
      expect_pairs(result, config(), answers[next++], to_vector(finder.pairs()),
                   scene.boxes.size());
    }
  }
}

TEST_P(Exact, MarginsOfTwoSets) {
  const BoxList a = snapped_boxes(150, 16, 0.1f, 5), b = snapped_boxes(170, 16, 0.1f, 6);
  for (const float margin : {0.05f, 0.1f, 0.2f}) {
    Options with = options();
    with.margin = margin;
    Finder finder(with);
    const Result result = finder.find(a, b);
    expect_pairs(result, config(), reference_pairs(a, b, margin), to_vector(finder.pairs()), 150);
  }
}

// Points at the end of the last column: memory behind them holds data of a larger scene, which must
// not be found.
TEST_P(Exact, NothingBeyondTheLastBox) {
  BoxList boxes(600, Box{{1, 1, 1}, {1, 1, 1}});
  for (std::size_t i = 0; i < boxes.size(); i += 7) boxes[i] = cube(0, 0, 0, 0.5f);
  Finder finder(options());
  for (const std::size_t count : {boxes.size(), std::size_t{431}, std::size_t{300}}) {
    const BoxList part(boxes.begin(), boxes.begin() + static_cast<std::ptrdiff_t>(count));
    const Answer answer = reference_pairs(part);
    const Result result = finder.find(Boxes(boxes.data(), count));
    expect_pairs(result, config(), answer, to_vector(finder.pairs()), count);
  }
}

// Sets smaller than any batch, tile, vector or row; in a grid, too, if one is requested.
TEST_P(Exact, TinySets) {
  // Two boxes in a grid so fine that one of them visits more rows than there are boxes.
  const BoxList apart = {{{0, 3, 4}, {0.764f, 4.0536f, 4.9559f}},
                         {{2.7906f, 0.4171f, 5.2914f}, {3.4139f, 2.2969f, 6.4506f}}};
  expect_exact(apart, config(), reference_pairs(apart));
  Random random(77);
  for (int round = 0; round < (sanitized ? 250 : 1000); ++round) {
    BoxList boxes;
    const int n = random.between(2, 9);
    for (int i = 0; i < n; ++i) {
      const Vec3 p = random.point(0, 5), q = random.point(0, round % 2 ? 5 : 1);
      boxes.push_back({p, {p.x + q.x, p.y + q.y, p.z + q.z}});
    }
    const std::size_t half = boxes.size() / 2;
    SCOPED_TRACE(round);
    expect_exact(boxes, config(), reference_pairs(boxes));
    const Boxes a(boxes.data(), half), b(boxes.data() + half, boxes.size() - half);
    expect_exact(a, b, config(), reference_pairs(a, b));
    if (HasFailure()) return;
  }
}

THRONG_INSTANTIATE(Exact, suite_configs);

}  // namespace
}  // namespace throng::tests
