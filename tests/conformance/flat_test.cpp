// A set of 2-D boxes with one of 3-D boxes, in both orders: 2-D boxes are at z = 0.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// Boxes that cross z = 0, touch it, miss it by one ulp, or lie in it.
BoxList around_zero(int n, std::uint64_t seed) {
  Random random(seed);
  BoxList boxes = uniform_boxes(n, seed);
  for (Box& box : boxes) {
    float& lower = box.lower.z;
    float& upper = box.upper.z;
    switch (random.below(9)) {
      case 0:
        lower = -1, upper = random.one_in(2) ? 0.0f : -0.0f;
        break;
      case 1:
        lower = random.one_in(2) ? 0.0f : -0.0f, upper = 1;
        break;
      case 2:
        lower = -1, upper = -denormal;
        break;
      case 3:
        lower = denormal, upper = 2;
        break;
      case 4:
        lower = upper = 0;
        break;
      case 5:
        lower = 0.5f, upper = 4;
        break;
      case 7:
        lower = -2, upper = -0.5f;
        break;
      case 6:
        lower = -infinity, upper = infinity;
        break;
      default:
        lower = -2, upper = 3;
        break;
    }
  }
  for (int i = 0; i < n; i += 97) std::swap(boxes[i].lower.z, boxes[i].upper.z);  // some inactive
  return boxes;
}

template <class Real>
struct Planes {
  std::vector<Real> corner[6];

  explicit Planes(const BoxList& boxes, double at = 0) {
    for (const Box& b : boxes) {
      const float c[6] = {b.lower.x, b.lower.y, b.lower.z, b.upper.x, b.upper.y, b.upper.z};
      for (int k = 0; k < 6; ++k)
        corner[k].push_back(static_cast<Real>(c[k]) + static_cast<Real>(k % 3 == 2 ? 0 : at));
    }
  }
  BasicBoxes<Real> view(bool flat) const {
    return BasicBoxes<Real>::arrays(
        corner[0].data(), corner[1].data(), flat ? nullptr : corner[2].data(), corner[3].data(),
        corner[4].data(), flat ? nullptr : corner[5].data(), corner[0].size());
  }
};

template <class Real>
void expect_mixed(const Config& config, double at) {
  for (const auto& [small, large] : {std::pair{300, 500}, std::pair{40, 2500}}) {
    const Planes<Real> a(around_zero(small, 1), at), b(around_zero(large, 2), at);
    for (const bool a_flat : {false, true}) {
      for (const bool b_flat : {false, true}) {
        SCOPED_TRACE(std::string(a_flat ? "flat" : "not flat") + " with " +
                     (b_flat ? "flat" : "not flat") + ", " + std::to_string(large));
        const BasicBoxes<Real> one = a.view(a_flat), other = b.view(b_flat);
        const Answer answer = reference_pairs(one, other), back = reference_pairs(other, one);
        ASSERT_GT(answer.pairs.size(), 10u);
        expect_exact(one, other, config, answer);
        expect_exact(other, one, config, back);
      }
    }
  }
}

class Flat : public Conformance {};

TEST_P(Flat, WithA3DSet) { expect_mixed<float>(config(), 0); }

// A margin makes boxes above and below overlap those at 0.
TEST_P(Flat, WithA3DSetAndMargin) {
  const Planes<float> a(around_zero(300, 3)), b(around_zero(400, 4));
  Options options = config().options();
  options.margin = 3.0f;
  for (const bool first : {false, true}) {
    Finder finder(options);
    const Boxes one = a.view(first), other = b.view(!first);
    const Result result = finder.find(one, other);
    expect_pairs(result, config(), reference_pairs(one, other, options.margin),
                 to_vector(finder.pairs()), 0);
  }
}

TEST_P(Flat, WithA3DSetOfDoubles) {
  if (config().backend != Backend::cpu) GTEST_SKIP() << "takes no doubles";
  expect_mixed<double>(config(), 0);
  expect_mixed<double>(config(), 1e9);
}

THRONG_INSTANTIATE(Flat, all_configs);

}  // namespace
}  // namespace throng::tests
