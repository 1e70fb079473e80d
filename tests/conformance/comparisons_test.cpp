// The number of candidate comparisons: a bound per box and reported pair, on every scene, and on
// boxes in layers.
#include <limits>

#include "apps/scenes/scene.hpp"
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"
#include "support/scene_boxes.hpp"

namespace throng::tests {
namespace {

struct Case {
  std::string name;
  std::size_t objects;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const std::string& name : scenes::names())
    for (const std::size_t objects : {std::size_t{10000}, std::size_t{100000}})
      all.push_back({name, objects});
  return all;
}

void PrintTo(const Case& c, std::ostream* out) { *out << c.name << ' ' << c.objects; }

class Comparisons : public testing::TestWithParam<Case> {};

// `limit`: for the CPU grid; `limit_of_pipeline`: for the device pipeline.
void expect_few(const Boxes& view, double limit, double limit_of_pipeline) {
  std::vector<Config> configs = single_configs();
  Config two_threads = configs.back();
  two_threads.threads = 2;
  configs.push_back(two_threads);
  for (const Config& config : configs) {
    if (config.algorithm == Algorithm::all_pairs) continue;
    SCOPED_TRACE(config.name());
    Finder finder(config.options());
    // The first search may find its pairs twice, as it has no buffer for them yet.
    ASSERT_TRUE(finder.find(view).ok());
    const Result result = finder.find(view);
    ASSERT_TRUE(result.ok()) << result.message;
    EXPECT_GE(result.comparisons, result.found);
    const double share =
        static_cast<double>(result.comparisons) / static_cast<double>(view.size() + result.found);
    const bool own = config.backend == Backend::cpu;
    EXPECT_LE(share, own ? limit : limit_of_pipeline)
        << result.comparisons << " comparisons, " << view.size() << " boxes, " << result.found
        << " pairs; " << result.plan.reason;
    testing::Test::RecordProperty(config.name(), std::to_string(share));
  }
}

TEST_P(Comparisons, AreFew) {
  scenes::Spec spec;
  spec.name = GetParam().name;
  spec.objects = GetParam().objects;
  const SceneBoxes made(spec);
  const double limit = spec.name == "rods-any" ? 300 : 100;
  expect_few(made.view(), limit, limit);
}

// Along the axis of the layers neither windows nor columns separate boxes of one layer.
TEST(ComparisonsOfLayers, AreFew) {
  Random r(7);
  BoxList rods, sheet;
  for (int i = 0; i < 50000; ++i) {
    const Vec3 at{r.unit() * 3000, r.unit() * 3000, static_cast<float>(i % 2)};
    const float x = i % 2 ? 200 : 0.1f, y = i % 2 ? 0.1f : 200;
    rods.push_back({at, {at.x + x, at.y + y, at.z + 0.1f}});
    sheet.push_back({at, {at.x + 1, at.y + 1, at.z + 0.1f}});
    if (i % 2 == 0) sheet.back().lower.z = sheet.back().upper.z = r.unit() * 300;
  }
  expect_few(Boxes(rods.data(), rods.size()), 100, 40);
  expect_few(Boxes(sheet.data(), sheet.size()), 50, 50);
}

// Comparisons of the CPU grid relative to boxes and pairs, on one instruction set.
double share_of(const Boxes& a, const Boxes* b = nullptr, const Options& options = {}) {
  Options with = options;
  with.backend = Backend::cpu;
  with.algorithm = Algorithm::grid;
  Finder finder(with);
  const auto find = [&] { return b ? finder.find(a, *b) : finder.find(a); };
  EXPECT_TRUE(find().ok());  // it may find pairs twice, without a buffer yet
  const Result result = find();
  EXPECT_TRUE(result.ok()) << result.message;
  const double size = static_cast<double>(a.size() + (b ? b->size() : 0) + result.found);
  return static_cast<double>(result.comparisons) / size;
}

// Layers at equal distances: cells of a sample have as many boxes as with an even spread, yet no
// window along the axis separates those of one layer.
TEST(ComparisonsOfLayers, AreFewWhereLayersAreEven) {
  for (const std::size_t n : {1500u, 8000u, 16000u, 60000u}) {
    for (int axis = 0; axis < 3; ++axis) {
      SCOPED_TRACE(std::to_string(n) + " boxes, layers across " + std::to_string(axis));
      Random r(n);
      const float side = std::sqrt(static_cast<float>(n) / 14 * 8);
      BoxList list, others;
      for (std::size_t i = 0; i < 2 * n; ++i) {
        Box box = cube(r.point(0, side), 1);
        (&box.lower.x)[axis] = static_cast<float>(r.below(14)) * 50;
        (&box.upper.x)[axis] = (&box.lower.x)[axis] + 0.1f;
        (i % 2 ? others : list).push_back(box);
      }
      const Boxes second = others;
      EXPECT_LE(share_of(list), 80);
      EXPECT_LE(share_of(list, &second), 80);
    }
  }
}

// Coordinates over some decades, independently per axis, on one side of 0 or on both; box sizes are
// a thousandth of these, or anything from that to a billionth.
struct Decades {
  float count;
  bool both;
  int axes;
  bool sizes;

  BoxList boxes(std::size_t n, std::uint64_t seed) const {
    Random r(seed);
    BoxList all(n);
    for (Box& box : all) {
      for (int k = 0; k < 3; ++k) {
        float& lower = (&box.lower.x)[k];
        float& upper = (&box.upper.x)[k];
        if (k >= axes) {
          lower = r.in(0, 100);
          upper = lower + 1;
          continue;
        }
        const float at = std::pow(10.0f, r.in(-count / 2, count / 2));
        const float half = at * (sizes ? std::pow(10.0f, r.in(-9, -3)) : 0.001f);
        const float sign = both && r.one_in(2) ? -1.0f : 1.0f;
        lower = sign * at - half;
        upper = sign * at + half;
      }
    }
    return all;
  }
};

TEST(ComparisonsOfDecades, AreFew) {
  constexpr std::size_t n = 30000;
  for (const Decades& d : {Decades{2, false, 3, false},
                           {4, false, 3, false},
                           {6, false, 3, false},
                           {12, false, 3, false},
                           {12, true, 3, false},
                           {20, false, 1, false},
                           {20, false, 2, false},
                           {20, true, 3, true},
                           {32, false, 3, false},
                           {60, true, 3, false},
                           {60, false, 3, true}}) {
    SCOPED_TRACE(std::to_string(d.count) + " decades of " + std::to_string(d.axes) + " axes" +
                 (d.both ? ", both signs" : "") + (d.sizes ? ", all sizes" : ""));
    const BoxList list = d.boxes(n, 1), other = d.boxes(n, 2);
    const Boxes boxes = list, others = other;
    EXPECT_LE(share_of(boxes), 60);
    EXPECT_LE(share_of(boxes, &others), 60);
    Options options;
    options.threads = 3;
    EXPECT_LE(share_of(boxes, nullptr, options), 60);
    options.margin = std::pow(10.0f, -d.count / 2 - 3);
    EXPECT_LE(share_of(boxes, nullptr, options), 60);
    Boxes worlds = boxes;
    std::vector<std::int32_t> world(n);
    for (std::size_t i = 0; i < n; ++i) world[i] = static_cast<std::int32_t>(i % 8);
    worlds.filters.world = {world.data(), n};
    EXPECT_LE(share_of(worlds), 60);
  }
}

// Decades around a centre other than 0, where floats are some 5e-7 apart.
TEST(ComparisonsOfDecades, AroundAnotherPlace) {
  for (const bool both : {false, true}) {
    BoxList list = Decades{12, both, 3, false}.boxes(30000, 3);
    for (Box& box : list)
      for (int k = 0; k < 6; ++k) (&box.lower.x)[k] += 5;
    EXPECT_LE(share_of(list), 100);
  }
}

// A scene at any scale costs the same as at 1: down to denormal floats, up to overflowing
// differences.
TEST(ComparisonsOfScales, AreAlike) {
  const BoxList usual = uniform_boxes(30000, 1), others = uniform_boxes(30000, 2);
  BoxList thin = usual;
  for (Box& box : thin) box.upper.z = box.lower.z + 0.001f;
  std::vector<std::int32_t> world(usual.size());
  for (std::size_t i = 0; i < world.size(); ++i) world[i] = static_cast<std::int32_t>(i % 8);
  const auto in_worlds = [&](const BoxList& list) {
    Boxes boxes = list;
    boxes.filters.world = {world.data(), world.size()};
    return share_of(boxes);
  };
  const Boxes b = others;
  const double of_usual = share_of(usual), of_two = share_of(usual, &b), of_thin = share_of(thin),
               of_worlds = in_worlds(usual);
  for (const int exponent : {-140, -134, -130, -126, -120, -112, -100, 100, 115, 121}) {
    SCOPED_TRACE(exponent);
    const float factor = std::ldexp(1.0f, exponent);
    const BoxList at_scale = scaled(usual, factor), other = scaled(others, factor);
    const Boxes second = other;
    EXPECT_LE(share_of(at_scale), 2 * of_usual);
    EXPECT_LE(share_of(at_scale, &second), 2 * of_two);
    EXPECT_LE(share_of(scaled(thin, factor)), 2 * of_thin);
    EXPECT_LE(in_worlds(at_scale), 2 * of_worlds);
    BoxList around = at_scale;  // on both sides of 0: at the largest scale the range is no float
    for (Box& box : around)
      for (int k = 0; k < 6; ++k) (&box.lower.x)[k] -= 20 * factor;
    EXPECT_LE(share_of(around), 2 * of_usual);
    BoxList flat = usual;  // one axis alone
    for (Box& box : flat) box.lower.y *= factor, box.upper.y *= factor;
    EXPECT_LE(share_of(flat), 2 * of_usual);
  }
}

// Boxes in one place that no filter allows to pair are not compared with each other: all of one
// owner, or of layers that do not collide; a few others among them pair with all.
TEST(ComparisonsOfForbidden, AreFew) {
  constexpr std::size_t n = 15000, others = 100;
  Random r(3);
  BoxList list;
  std::vector<std::int32_t> owner;
  std::vector<std::uint32_t> group, mask;
  for (std::size_t i = 0; i < n + others; ++i) {
    list.push_back(cube(r.point(0, 1), 1));
    const bool is_other = i % 151 == 150;
    owner.push_back(is_other ? -1 : 7);
    group.push_back(is_other ? 8 : 1u << i % 3);
    mask.push_back(is_other ? 15 : 8);
  }
  Boxes owned = list, layers = list;
  owned.filters.owner = {owner.data(), owner.size()};
  layers.filters.group = {group.data(), group.size()};
  layers.filters.mask = {mask.data(), mask.size()};
  EXPECT_LE(share_of(owned), 4);
  EXPECT_LE(share_of(layers), 4);
  EXPECT_LE(share_of(owned, &owned), 4);
  EXPECT_LE(share_of(layers, &layers), 4);
  std::fill(owner.begin(), owner.end(), 7);
  EXPECT_LE(share_of(owned), 1);
}

// Comparisons of the device pipeline relative to boxes and pairs.
double share_of_pipeline(const Boxes& boxes) {
  Options options;
  options.backend = Backend::emulated;
  options.algorithm = Algorithm::grid;
  Finder finder(options);
  const Result result = finder.find(boxes);
  EXPECT_TRUE(result.ok()) << result.message;
  return static_cast<double>(result.comparisons) / static_cast<double>(boxes.size() + result.found);
}

// The grid covers most boxes, here a heap of static ones; distant movers share its outermost cells.
TEST(ComparisonsOfFarMovers, AreFew) {
  for (const float side : {1.0f, 8.0f}) {
    Random r(3);
    BoxList list;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 at = r.point(0, side);
      list.push_back(cube(1000 + at.x, 1000 + at.y, 1000 + at.z, 4));
    }
    std::vector<std::uint8_t> is_static(list.size(), 1);
    for (int i = 0; i < 800; ++i) list.push_back(cube(r.point(0, 30), 1));
    is_static.resize(list.size());
    Boxes boxes = list;
    boxes.filters.is_static = {is_static.data(), is_static.size()};
    EXPECT_LE(share_of_pipeline(boxes), 40) << side;
  }
}

// Boxes unbounded along one axis are separated along the others, even if they are few.
TEST(ComparisonsOfUnbounded, AreFew) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const std::uint32_t one_in : {1u, 3u, 20u}) {
    for (const std::uint32_t axes : {1u, 3u, 7u}) {
      for (const float side : {300.0f, 450.0f, 1200.0f}) {
        SCOPED_TRACE("one in " + std::to_string(one_in) + ", axes " + std::to_string(axes) +
                     ", side " + std::to_string(side));
        Random r(axes);
        BoxList list;
        for (int i = 0; i < 20000; ++i) {
          Box box = cube(r.point(0, side), 1);
          const std::uint32_t along = r.below(3);
          if (axes >> along & 1 && r.one_in(one_in)) {
            (&box.lower.x)[along] = -infinity;
            (&box.upper.x)[along] = infinity;
          }
          list.push_back(box);
        }
        EXPECT_LE(share_of_pipeline(list), 100);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Comparisons, testing::ValuesIn(cases()), [](const auto& which) {
  std::string name = which.param.name + "_" + std::to_string(which.param.objects);
  for (char& c : name) {
    if (c == '-') c = '_';
  }
  return name;
});

}  // namespace
}  // namespace throng::tests
