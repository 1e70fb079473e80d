// How many candidates the library compares: a bound a box and reported pair, on every scene, and
// on boxes that lie in layers.
#include "scene/scene.hpp"
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
  for (const std::string& name : scene::names())
    for (const std::size_t objects : {std::size_t{10000}, std::size_t{100000}})
      all.push_back({name, objects});
  return all;
}

void PrintTo(const Case& c, std::ostream* out) { *out << c.name << ' ' << c.objects; }

class Comparisons : public testing::TestWithParam<Case> {};

// `limit`: of the CPU's own grid, and of the pipeline's.
void expect_few(const Boxes& view, double limit, double limit_of_pipeline) {
  std::vector<Config> configs = single_configs();
  Config two_threads = configs.back();
  two_threads.threads = 2;
  configs.push_back(two_threads);
  for (const Config& config : configs) {
    if (config.algorithm == Algorithm::all_pairs) continue;
    SCOPED_TRACE(config.name());
    Finder finder(config.options());
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
  scene::Spec spec;
  spec.name = GetParam().name;
  spec.objects = GetParam().objects;
  const SceneBoxes made(spec);
  const double limit = spec.name == "rods-any" ? 300 : 100;
  expect_few(made.view(), limit, limit);
}

// Along an axis of layers neither windows nor columns tell boxes of one layer apart.
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
  expect_few(Boxes(rods.data(), rods.size()), 100, 200);
  expect_few(Boxes(sheet.data(), sheet.size()), 50, 50);
}

// What is looked into beside comparisons: by brute force each box once, in a grid each column and a
// box in each of its columns, and what it takes to find pairs twice where there was no room.
TEST(Visited, CountsBoxesColumnsAndPasses) {
  BoxList boxes = uniform_boxes(20000, 1);
  const Boxes few(boxes.data(), 300), all = boxes;
  Options options;
  options.threads = 1;
  options.algorithm = Algorithm::all_pairs;
  Pair none;
  EXPECT_EQ(Finder(options).find(few, &none, 0).visited, 300u);
  EXPECT_EQ(Finder(options).find(few, all, &none, 0).visited, 20300u);

  options.algorithm = Algorithm::grid;
  const Result grid = Finder(options).find(all, &none, 0);
  const std::uint64_t columns = grid.plan.columns[0] * grid.plan.columns[1] * grid.plan.columns[2];
  EXPECT_GE(grid.visited, boxes.size() + columns);
  EXPECT_LE(grid.visited, 4 * boxes.size() + columns);

  // A thousand boxes that span too many columns: each is looked at in every column.
  for (std::size_t i = 0; i < boxes.size(); i += 20) boxes[i] = {{0, 0, 0}, {40, 40, 40}};
  options.cell_scale = 0.25f;
  const Result wide = Finder(options).find(all, &none, 0);
  const std::uint64_t finer = wide.plan.columns[0] * wide.plan.columns[1] * wide.plan.columns[2];
  EXPECT_GE(wide.visited, 500 * finer) << finer << " columns";
  options.cell_scale = 1;

  // All boxes in one place: what was thought to be room for the pairs is not.
  const BoxList heap(2000, boxes[1]);
  Finder finder(options);
  const Result cold = finder.find(Boxes(heap)), warm = finder.find(Boxes(heap));
  EXPECT_EQ(cold.found, warm.found);
  EXPECT_GT(cold.comparisons, warm.comparisons * 3 / 2);
  EXPECT_GT(cold.visited, warm.visited * 3 / 2);
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
