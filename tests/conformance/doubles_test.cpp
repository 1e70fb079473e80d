// Boxes of doubles: exact pairs, even if floats do not distinguish the boxes.
#include <cmath>
#include <cstring>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

using DoubleList = std::vector<DoubleBox>;

class Doubles : public Conformance {};

std::vector<Config> cpu_configs() {
  std::vector<Config> configs;
  for (const Config& config : suite_configs())
    if (config.backend == Backend::cpu) configs.push_back(config);
  return configs;
}

// Converts a scene of floats to doubles: scale * x + origin, and each coordinate moved by up to two
// ulps. Touching faces then overlap or miss by less than float resolution.
struct Setting {
  const char* name;
  double scale;
  DoubleVec3 origin;
};
constexpr Setting settings[] = {
    {"as they are", 1, {0, 0, 0}},
    {"thirds", 1.0 / 3, {0.1, -0.2, 0.3}},
    {"nanometres, a million metres away", 1e-9, {5e5, 4.2e6, -3e2}},
    {"along one axis far away", 0.7, {0, 1e12, 0}},
};

double nudged(double x, int steps) {
  for (; steps > 0; --steps) x = std::nextafter(x, std::numeric_limits<double>::infinity());
  for (; steps < 0; ++steps) x = std::nextafter(x, -std::numeric_limits<double>::infinity());
  return x;
}

DoubleList to_doubles(const BoxList& boxes, const Setting& s, Random& random) {
  DoubleList list;
  const double origin[3] = {s.origin.x, s.origin.y, s.origin.z};
  for (const Box& box : boxes) {
    float from[6];
    std::memcpy(from, &box, sizeof from);
    double to[6];
    for (int k = 0; k < 6; ++k) {
      to[k] = s.scale * double{from[k]} + origin[k % 3];
      if (!random.one_in(3)) to[k] = nudged(to[k], random.between(-2, 2));
    }
    list.push_back({{to[0], to[1], to[2]}, {to[3], to[4], to[5]}});
  }
  return list;
}

struct Hard {
  std::string name;
  DoubleList boxes;
  Answer answer, split_answer;  // as one set, and of the first third with the rest
  DoubleBoxes one() const { return {boxes.data(), boxes.size() / 3}; }
  DoubleBoxes other() const {
    return {boxes.data() + boxes.size() / 3, boxes.size() - boxes.size() / 3};
  }
};

const std::vector<Hard>& hard_doubles() {
  static const std::vector<Hard> all = [] {
    std::vector<Hard> made;
    std::vector<HardScene> scenes = hard_scenes(sanitized ? 500 : 900);
    scenes.push_back({"many", uniform_boxes(sanitized ? 7000 : 12000, 77)});
    Random random(1);
    std::size_t next = 0;
    for (const HardScene& scene : scenes) {
      for (const Setting& setting : settings) {
        if (sanitized && ++next % 5 != 0) continue;
        Hard hard{
            scene.name + ", " + setting.name, to_doubles(scene.boxes, setting, random), {}, {}};
        hard.answer = reference_pairs(hard.boxes);
        hard.split_answer = reference_pairs(hard.one(), hard.other());
        made.push_back(std::move(hard));
      }
    }
    return made;
  }();
  return all;
}

TEST_P(Doubles, HardScenes) {
  for (const Hard& hard : hard_doubles()) {
    SCOPED_TRACE(hard.name);
    expect_exact(hard.boxes, config(), hard.answer);
    if (HasFailure()) return;
  }
}

TEST_P(Doubles, HardScenesInTwoSets) {
  for (const Hard& hard : hard_doubles()) {
    SCOPED_TRACE(hard.name);
    expect_exact(hard.one(), hard.other(), config(), hard.split_answer);
    if (HasFailure()) return;
  }
}

// Enough boxes in one column for a nested grid, and boxes over most columns, all of them within few
// floats of one another.
TEST_P(Doubles, ClustersAndWideBoxes) {
  static const Hard hard = [] {
    BoxList boxes = clusters_and_outliers(sanitized ? 4000 : 12000, 5);
    Random random(6);
    for (int k = 0; k < 24; ++k) {
      Box& box = boxes[random.below(static_cast<std::uint32_t>(boxes.size()))];
      box = {{-1e3f, -1e3f, -1e3f}, {1e3f, 1e3f, 1e3f}};
      if (k % 3 == 1) box.upper.y = box.lower.y = 0;
      if (k % 3 == 2) box.lower.z = -infinity, box.upper.z = infinity;
    }
    Hard made{"", to_doubles(boxes, settings[1], random), {}, {}};
    made.answer = reference_pairs(made.boxes);
    return made;
  }();
  expect_exact(hard.boxes, config(), hard.answer);
}

struct Filtered {
  DoubleList boxes;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> still;
  std::vector<Answer> one, two;  // per combination of filters; `two`: the second set unfiltered

  Filtered() {
    Random random(3);
    boxes = to_doubles(snapped_boxes(sanitized ? 500 : 900, 7, 0.1f, 4), settings[1], random);
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
      group.push_back(1u << i % 5), mask.push_back(random.below(32));
      owner.push_back(random.between(-1, 40)), world.push_back(random.between(-1, 3));
      still.push_back(random.one_in(3));
    }
    for (int given = 1; given < 16; ++given) {
      one.push_back(reference_pairs(view(given)));
      two.push_back(reference_pairs(view(given), view(0)));
    }
  }
  DoubleBoxes view(int given) const {
    const std::size_t n = boxes.size();
    DoubleBoxes view = boxes;
    if (given & 1) view.filters.group = {group.data(), n}, view.filters.mask = {mask.data(), n};
    if (given & 2) view.filters.owner = {owner.data(), n};
    if (given & 4) view.filters.world = {world.data(), n};
    if (given & 8) view.filters.is_static = {still.data(), n};
    return view;
  }
};

TEST_P(Doubles, EveryFilter) {
  static const Filtered all;
  for (int given = 1; given < 16; ++given) {
    SCOPED_TRACE(given);
    const auto k = static_cast<std::size_t>(given - 1);
    expect_exact(all.view(given), config(), all.one[k]);
    expect_exact(all.view(given), all.view(0), config(), all.two[k]);
  }
}

// With a margin they overlap or miss each other by one ulp of a double.
TEST_P(Doubles, Margin) {
  static const std::vector<Hard> gaps = [] {
    std::vector<Hard> all;
    Random random(8);
    for (const Setting& setting : settings) {
      Hard hard{setting.name, {}, {}, {}};
      const double margin = 0.25;
      for (int i = 0; i < 1500; ++i) {
        const double x = setting.origin.x + 1.5 * i;
        hard.boxes.push_back({{nudged(x, random.between(-2, 2)), setting.origin.y, 0},
                              {nudged(x + 1.5 - 2 * margin, random.between(-2, 2)),
                               setting.origin.y, random.one_in(20) ? -1.0 : 1.0}});
      }
      hard.answer = reference_pairs(hard.boxes, 0.25f);
      all.push_back(hard);
    }
    return all;
  }();
  for (const Hard& hard : gaps) {
    SCOPED_TRACE(hard.name);
    Options o = options();
    o.margin = 0.25f;
    Finder finder(o);
    const Result result = finder.find(hard.boxes);
    expect_pairs(result, config(), hard.answer, to_vector(finder.pairs()), 0);
  }
}

// If the margin falls between two doubles, it is rounded outward.
TEST_P(Doubles, MarginBetweenDoubles) {
  constexpr float margin = 0.1f;
  static const Hard hard = [] {
    Hard made{"", {}, {}, {}};
    Random random(12);
    const double unit = nudged(1e12, 1) - 1e12;
    const double gap = std::ceil(double{margin} / unit) * unit * 2;
    for (double x = -1e12, i = 0; i < 900; ++i, x += 1 + gap) {
      if (i == 450) x = 1e12;
      made.boxes.push_back(
          {{nudged(x, random.between(-1, 1)), 0, 0}, {nudged(x + 1, random.between(-1, 1)), 1, 1}});
    }
    made.answer = reference_pairs(made.boxes, margin);
    return made;
  }();
  EXPECT_GT(hard.answer.pairs.size(), 200u);
  EXPECT_LT(hard.answer.pairs.size(), 800u);
  Options o = options();
  o.margin = margin;
  Finder finder(o);
  const Result result = finder.find(hard.boxes);
  expect_pairs(result, config(), hard.answer, to_vector(finder.pairs()), 0);
}

// An inverted box is an empty slot even if inverted by one ulp, and stays one under a margin.
TEST_P(Doubles, InvertedByOneUlp) {
  DoubleList boxes(700, {{1, 1, 1}, {1, 1, 1}});
  for (std::size_t i = 0; i < boxes.size(); i += 3) boxes[i].upper.y = nudged(1, -1);
  expect_exact(boxes, config(), reference_pairs(boxes));
  Options o = options();
  o.margin = 1;
  Finder finder(o);
  const Result result = finder.find(boxes);
  expect_pairs(result, config(), reference_pairs(boxes, 1), to_vector(finder.pairs()), 0);
}

TEST_P(Doubles, BeyondFloats) {
  const double inf = std::numeric_limits<double>::infinity(), most = 1.7e308, least = 4e-324;
  Random random(9);
  const double ends[] = {-inf,  -most,  -1e300, -1e39, -1,    -1e-310, -least, 0,
                         least, 1e-310, 1,      1e39,  1e300, most,    inf};
  DoubleList boxes;
  for (int i = 0; i < 500; ++i) {
    double corner[6];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t at = random.below(14);
      corner[k] = ends[at];
      corner[3 + k] = ends[at + random.below(15 - at)];
    }
    boxes.push_back({{corner[0], corner[1], corner[2]}, {corner[3], corner[4], corner[5]}});
  }
  expect_exact(boxes, config(), reference_pairs(boxes));
  Options o = options();
  o.margin = 3e38f;
  Finder finder(o);
  const Result result = finder.find(boxes);
  expect_pairs(result, config(), reference_pairs(boxes, o.margin), to_vector(finder.pairs()), 0);
}

TEST_P(Doubles, EveryLayout) {
  Random random(10);
  const DoubleList boxes = to_doubles(snapped_boxes(700, 6, 0.1f, 11), settings[1], random);
  const std::size_t n = boxes.size();
  const Answer answer = reference_pairs(boxes);
  struct Body {
    float mass;
    DoubleBox box;
  };
  std::vector<Body> bodies;
  std::vector<DoubleVec3> lower, upper;
  std::vector<double> axis[6];
  for (const DoubleBox& box : boxes) {
    bodies.push_back({1, box});
    lower.push_back(box.lower), upper.push_back(box.upper);
    double corner[6];
    std::memcpy(corner, &box, sizeof corner);
    for (int k = 0; k < 6; ++k) axis[k].push_back(corner[k]);
  }
  expect_exact(DoubleBoxes(&bodies[0].box, n, sizeof(Body)), config(), answer);
  expect_exact(DoubleBoxes::split(lower.data(), upper.data(), n), config(), answer);
  expect_exact(DoubleBoxes::arrays(axis[0].data(), axis[1].data(), axis[2].data(), axis[3].data(),
                                   axis[4].data(), axis[5].data(), n),
               config(), answer);
  const DoubleBoxes flat = DoubleBoxes::arrays(axis[0].data(), axis[1].data(), nullptr,
                                               axis[3].data(), axis[4].data(), nullptr, n);
  expect_exact(flat, config(), reference_pairs(flat));
  expect_exact(DoubleBoxes(), config(), {});
  expect_exact(DoubleBoxes(&boxes[0], 300, 0), config(),
               reference_pairs(DoubleBoxes(&boxes[0], 300, 0)));  // one box 300 times
}

// Every form of the call returns the same.
TEST_P(Doubles, EveryForm) {
  const Hard& hard = hard_doubles()[1];
  std::vector<Pair> pairs;
  ASSERT_TRUE(find_pairs(hard.boxes, pairs, options()).ok());
  EXPECT_TRUE(same_pairs(pairs, hard.answer.pairs));
  EXPECT_TRUE(same_pairs(find_pairs(hard.boxes, options()), hard.answer.pairs));
  EXPECT_TRUE(same_pairs(find_pairs(hard.one(), hard.other(), options()), hard.split_answer.pairs));
  ASSERT_TRUE(find_pairs(hard.one(), hard.other(), pairs, options()).ok());
  EXPECT_TRUE(same_pairs(pairs, hard.split_answer.pairs));

  Finder finder(options());
  pairs.assign(hard.answer.pairs.size(), {});
  Result result = finder.find(hard.boxes, pairs.data(), pairs.size());
  expect_pairs(result, config(), hard.answer, pairs, 0);
  result = finder.find(hard.boxes, pairs.data(), pairs.size() - 1);
  EXPECT_EQ(result.status, Status::buffer_too_small);
  EXPECT_EQ(result.found, hard.answer.pairs.size());
  pairs.assign(hard.split_answer.pairs.size(), {});
  result = finder.find(hard.one(), hard.other(), pairs.data(), pairs.size());
  expect_pairs(result, config(), hard.split_answer, pairs, 0);

  pairs.clear();
  const auto take = [&](const Pair* block, std::size_t count) {
    pairs.insert(pairs.end(), block, block + count);
    return true;
  };
  result = finder.consume(hard.boxes, take);
  expect_pairs(result, config(), hard.answer, pairs, 0);
  pairs.clear();
  result = finder.consume(hard.one(), hard.other(), take);
  expect_pairs(result, config(), hard.split_answer, pairs, 0);
}

// The error for a cap that is too small names one that is enough, including the floats for the
// doubles.
TEST_P(Doubles, UnderACap) {
  const Hard& hard = hard_doubles()[1];
  Options o = options();
  std::vector<Pair> pairs;
  const auto take = [&](const Pair* block, std::size_t count) {
    pairs.insert(pairs.end(), block, block + count);
    return true;
  };
  o.memory_cap_bytes = 24 * hard.boxes.size();
  for (int tries = 0; tries < 6; ++tries) {
    Finder finder(o);
    pairs.clear();
    const Result result = finder.consume(hard.boxes, take);
    if (result.ok()) {
      EXPECT_GT(tries, 0);
      EXPECT_LE(finder.memory_bytes(), o.memory_cap_bytes);
      EXPECT_TRUE(same_pairs(pairs, hard.answer.pairs));
      return;
    }
    ASSERT_EQ(result.status, Status::memory_cap_too_small);
    ASSERT_GT(result.bytes_needed, o.memory_cap_bytes);
    o.memory_cap_bytes = static_cast<std::size_t>(result.bytes_needed);
  }
  FAIL() << "no cap was enough";
}

TEST_P(Doubles, Errors) {
  DoubleList boxes(900, {{0, 0, 0}, {1, 1, 1}});
  boxes[613].upper.y = boxes[790].lower.x = std::nan("");
  Finder finder(options());
  Result result = finder.find(boxes);
  EXPECT_EQ(result.status, Status::nan_box);
  EXPECT_EQ(result.first_invalid, 613u);
  EXPECT_EQ(result.invalid_count, 2u);
  result = finder.find(DoubleBoxes(boxes.data(), 600), boxes);
  EXPECT_EQ(result.status, Status::nan_box);
  EXPECT_NE(std::string(result.message).find("box 613 of the second set"), std::string::npos);
  result = finder.find(DoubleBoxes(boxes.data(), 600, 52));
  EXPECT_EQ(result.status, Status::bad_boxes);
  EXPECT_NE(std::string(result.message).find("multiple of 8"), std::string::npos);
  result = finder.find(DoubleBoxes(nullptr, 3));
  EXPECT_EQ(result.status, Status::bad_boxes);

  Options o = options();
  o.nan = NanPolicy::inactive;
  EXPECT_EQ(find_pairs(boxes, o).size(), 898u * 897 / 2);
  o.backend = Backend::emulated;
  try {
    find_pairs(boxes, o);
    FAIL() << "the emulated backend does not support doubles";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::bad_option);
    EXPECT_NE(std::string(error.what()).find("backend emulated"), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Doubles, testing::ValuesIn(cpu_configs()), config_name);

}  // namespace
}  // namespace throng::tests
