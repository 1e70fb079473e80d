// Lattices of touching boxes, more than ten million touching pairs in all, in every configuration:
// random boxes never test this.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Lattices : public Conformance {};

struct Solved {
  std::string name;
  BoxList boxes;
  Answer answer;
};

Solved solve(std::string name, BoxList boxes, int axis) {
  Answer answer = swept_pairs(boxes, axis);
  return {std::move(name), std::move(boxes), std::move(answer)};
}

Solved solve(const Lattice& lattice) {
  const int longest =
      static_cast<int>(std::max_element(lattice.count, lattice.count + 3) - lattice.count);
  return solve(lattice.describe(), make_lattice(lattice), longest);
}

// A few thousand boxes each: every shape, pitch, position and perturbation.
const std::vector<Solved>& small_lattices() {
  static const std::vector<Solved> solved = [] {
    std::vector<Solved> all;
    for (std::uint64_t seed = 1000; seed < 1175; ++seed) {
      all.push_back(solve(random_lattice(seed, seed % 4 == 0 ? 1200 : 5000)));
    }
    // Unit cubes on integers, worlds of a power of two: upper ends fall on the boundaries of any
    // regular grid.
    for (const int side : {1, 2, 3, 4, 8, 16}) {
      for (int axis = 0; axis < 3; ++axis) {
        Lattice lattice;
        lattice.seed = static_cast<std::uint64_t>(side);
        for (int k = 0; k < 3; ++k) lattice.count[k] = k == axis ? 4096 / (side * side) : side;
        all.push_back(solve(lattice));
      }
    }
    return all;
  }();
  return solved;
}

// Large ones, where columns are many or very full, and the planner takes its paths for many boxes.
const std::vector<Solved>& large_lattices() {
  static const std::vector<Solved> solved = [] {
    std::vector<Solved> all;
    const int shapes[][3] = {{700, 12, 12}, {12, 700, 12}, {12, 12, 700},
                             {43, 42, 41},  {300, 330, 1}, {1, 300, 330},
                             {2, 3, 20000}, {20000, 3, 2}, {110000, 1, 1}};
    std::uint64_t seed = 1;
    for (const auto& shape : shapes) {
      Lattice lattice = random_lattice(seed, 1000);
      for (int k = 0; k < 3; ++k) lattice.count[k] = shape[k];
      lattice.span = 1;
      lattice.nudge = static_cast<int>(seed % 3);
      lattice.seed = seed++;
      all.push_back(solve(lattice));
    }
    // More boxes in one column than 16 bits can number: 70,000 stacked sheets, and a few boxes
    // through them all.
    for (int axis = 0; axis < 3; ++axis) {
      BoxList boxes;
      for (int i = 0; i < 70000; ++i) {
        Box box = cube(0, 0, 0, 1);
        (&box.lower.x)[axis] = (&box.upper.x)[axis] = static_cast<float>(i) * 0.5f;
        boxes.push_back(box);
      }
      boxes[777] = {{0, 0, 0}, {40000, 40000, 40000}};
      boxes[69999] = {{1, 1, 1}, {40000, 40000, 40000}};
      all.push_back(solve("70,000 sheets", std::move(boxes), axis));
    }
    return all;
  }();
  return solved;
}

// Brute force has no shortcut that needs a larger lattice: it runs the small ones, and each of them
// once.
TEST_P(Lattices, Small) {
  const bool all = config().algorithm != Algorithm::all_pairs ||
                   (config().isa == supported_isas().back() && config().threads == 1);
  for (const Solved& s : small_lattices()) {
    if (!all && s.boxes.size() > 2000) continue;
    SCOPED_TRACE(s.name);
    expect_exact(s.boxes, config(), s.answer);
    if (HasFailure()) return;  // one lattice is enough
  }
}

THRONG_INSTANTIATE(Lattices, suite_configs);

class LargeLattices : public Conformance {};

std::vector<Config> grid_configs() {
  std::vector<Config> configs;
  for (const Config& config : suite_configs())
    if (config.algorithm != Algorithm::all_pairs &&
        (config.threads == 0 || config.threads % 2 == 1))
      configs.push_back(config);
  return configs;
}

TEST_P(LargeLattices, AreExact) {
  for (const Solved& s : large_lattices()) {
    SCOPED_TRACE(s.name);
    expect_exact(s.boxes, config(), s.answer);
    if (HasFailure()) return;
  }
}

// Enough boxes for many columns on every instruction set, and overlapping boxes over most columns:
// with all pairs, by worlds, by static, and in two sets. The expected pairs derive from those of
// the plain set.
TEST_P(LargeLattices, WideAmongMany) {
  constexpr std::size_t n = 60000, cut = 20000;
  static const BoxList boxes = [] {
    BoxList all = uniform_boxes(n, 31);
    Random random(32);
    for (int k = 0; k < 24; ++k) {
      Box& box = all[random.below(n)];
      const Vec3 at = random.point(-5, 45);
      box = {at, {at.x + 48, at.y + 48, at.z + 48}};
      if (k % 3 == 1) box.upper.y = box.lower.y;  // a sheet
      if (k % 3 == 2) box.lower.z = -infinity, box.upper.z = infinity;
    }
    return all;
  }();
  std::vector<std::int32_t> world;
  std::vector<std::uint8_t> still;
  for (std::size_t i = 0; i < n; ++i) {
    world.push_back(static_cast<std::int32_t>(i % 4) - 1);
    still.push_back(i % 5 < 3);
  }
  Boxes worlds = boxes, statics = boxes;
  worlds.filters.world = {world.data(), n};
  statics.filters.is_static = {still.data(), n};
  static const Answer plain = swept_pairs(boxes);
  const auto keep = [](const Boxes& view) {
    const std::vector<Item> items = read_items(view, 0);
    Answer answer;
    for (const Pair& pair : plain.pairs)
      if (wanted(items[pair.first], items[pair.second])) answer.pairs.push_back(pair);
    return answer;
  };
  Answer halves;
  for (const Pair& pair : plain.pairs)
    if (pair.first < cut && pair.second >= cut)
      halves.pairs.push_back({pair.first, pair.second - static_cast<std::uint32_t>(cut)});
  expect_exact(boxes, config(), plain);
  expect_exact(worlds, config(), keep(worlds));
  expect_exact(statics, config(), keep(statics));
  expect_exact(Boxes(boxes.data(), cut), Boxes(boxes.data() + cut, n - cut), config(), halves);
}

INSTANTIATE_TEST_SUITE_P(All, LargeLattices, testing::ValuesIn(grid_configs()), config_name);

// More pairs than 32 bits can count, none of which is stored.
class Totals : public Conformance {};

TEST_P(Totals, MoreThan32Bits) {
  constexpr std::uint64_t n = 93000, pairs = n * (n - 1) / 2;
  static_assert(pairs > std::uint64_t{1} << 32);
  const BoxList boxes = identical_boxes(n, 1);
  Finder finder(options());
  const Result r = finder.find(boxes, nullptr, 0);
  EXPECT_EQ(r.status, Status::buffer_too_small);
  EXPECT_EQ(r.found, pairs);
  EXPECT_EQ(r.written, 0u);
  EXPECT_GE(r.comparisons, pairs);
  EXPECT_NE(std::string(r.message).find(std::to_string(pairs)), std::string::npos) << r.message;
}

std::vector<Config> total_configs() {
  std::vector<Config> configs = {{Algorithm::automatic, Isa::automatic, 0, Order::any},
                                 {Algorithm::all_pairs, Isa::automatic, 0, Order::any},
                                 {Algorithm::grid, Isa::scalar, 0, Order::any, Backend::emulated}};
  if (cuda::available().ok())
    configs.push_back({Algorithm::all_pairs, Isa::scalar, 1, Order::any, Backend::cuda});
  return configs;
}
INSTANTIATE_TEST_SUITE_P(All, Totals, testing::ValuesIn(total_configs()), config_name);

// Validates the tests above: this many pairs touch face to face.
TEST(LatticeCount, MoreThanTenMillionTouch) {
  std::uint64_t touches = 0, boxes = 0, narrow = 0;
  for (const auto* solved : {&small_lattices(), &large_lattices()}) {
    for (const Solved& s : *solved) {
      boxes += s.boxes.size();
      narrow += s.name.find("1x") == 0 || s.name.find("2x") == 0 || s.name.find("3x") == 0;
      for (const Pair& pair : s.answer.pairs)
        touches += touching(s.boxes[pair.first], s.boxes[pair.second]);
    }
  }
  RecordProperty("touching_pairs", std::to_string(touches));
  std::printf("%llu pairs touch, of %llu boxes\n", static_cast<unsigned long long>(touches),
              static_cast<unsigned long long>(boxes));
  EXPECT_GE(touches, 10000000u);
  EXPECT_GE(narrow, 20u);
}

}  // namespace
}  // namespace throng::tests
