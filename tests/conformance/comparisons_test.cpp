// How many candidates the library compares: a bound a box and reported pair, on every scene.
#include "scene/scene.hpp"
#include "support/configs.hpp"
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

TEST_P(Comparisons, AreFew) {
  scene::Spec spec;
  spec.name = GetParam().name;
  spec.objects = GetParam().objects;
  const SceneBoxes made(spec);
  const Boxes view = made.view();
  const double limit = spec.name == "rods-any" ? 300 : 100;

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
    EXPECT_LE(share, limit) << result.comparisons << " comparisons, " << view.size() << " boxes, "
                            << result.found << " pairs; " << result.plan.reason;
    RecordProperty(config.name(), std::to_string(share));
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
