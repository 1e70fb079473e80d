// The same boxes in every layout that a view supports give the same pairs.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class View : public Conformance {};

TEST_P(View, PackedWithAStride) {
  struct Body {
    double mass;
    Box box;
    float rest[3];
  };
  const BoxList boxes = snapped_boxes(700, 12, 0.1f, 1);
  const Answer answer = reference_pairs(boxes);
  std::vector<Body> bodies(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) bodies[i] = {1e300, boxes[i], {-9e9f, 9e9f, 0}};
  expect_exact(Boxes(&bodies[0].box, bodies.size(), sizeof(Body)), config(), answer);
}

// Each stride of a whole number of floats; the last box ends where the memory ends.
TEST_P(View, EveryStride) {
  const BoxList boxes = snapped_boxes(75, 6, 1, 2);
  const Answer answer = reference_pairs(boxes);
  for (std::size_t floats = 6; floats < 20; ++floats) {
    std::vector<float> memory((boxes.size() - 1) * floats + 6, std::nanf(""));
    for (std::size_t i = 0; i < boxes.size(); ++i)
      std::memcpy(&memory[i * floats], &boxes[i], sizeof(Box));
    const Box* first = reinterpret_cast<const Box*>(memory.data());
    SCOPED_TRACE(floats);
    expect_exact(Boxes(first, boxes.size(), floats * sizeof(float)), config(), answer);
  }
}

TEST_P(View, SplitCorners) {
  const BoxList boxes = snapped_boxes(700, 12, 0.1f, 3);
  const Answer answer = reference_pairs(boxes);
  std::vector<Vec3> lower, upper;
  for (const Box& box : boxes) lower.push_back(box.lower), upper.push_back(box.upper);
  expect_exact(Boxes::split(lower.data(), upper.data(), boxes.size()), config(), answer);
  // Four floats per corner, as in SIMD engines.
  std::vector<float> wide_lower(boxes.size() * 4 - 1), wide_upper(boxes.size() * 4 - 1);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    std::memcpy(&wide_lower[4 * i], &boxes[i].lower, sizeof(Vec3));
    std::memcpy(&wide_upper[4 * i], &boxes[i].upper, sizeof(Vec3));
  }
  expect_exact(Boxes::split(reinterpret_cast<const Vec3*>(wide_lower.data()),
                            reinterpret_cast<const Vec3*>(wide_upper.data()), boxes.size(), 16),
               config(), answer);
}

struct Columns {
  std::vector<float> c[6];
  explicit Columns(const BoxList& boxes) {
    for (const Box& b : boxes) {
      const float values[6] = {b.lower.x, b.lower.y, b.lower.z, b.upper.x, b.upper.y, b.upper.z};
      for (int k = 0; k < 6; ++k) c[k].push_back(values[k]);
    }
  }
};

TEST_P(View, SixArrays) {
  for (const int n : {1, 5, 16, 17, 700}) {
    const BoxList boxes = snapped_boxes(n, 8, 0.1f, 4);
    const Columns a(boxes);
    expect_exact(Boxes::arrays(a.c[0].data(), a.c[1].data(), a.c[2].data(), a.c[3].data(),
                               a.c[4].data(), a.c[5].data(), boxes.size()),
                 config(), reference_pairs(boxes));
  }
}

TEST_P(View, TwoDimensions) {
  for (const int n : {1, 2, 33, 900}) {
    BoxList boxes = snapped_boxes(n, 30, 0.1f, 5);
    const Columns a(boxes);
    for (Box& box : boxes) box.lower.z = box.upper.z = 0;
    const Boxes flat = Boxes::arrays(a.c[0].data(), a.c[1].data(), nullptr, a.c[3].data(),
                                     a.c[4].data(), nullptr, boxes.size());
    const Answer answer = reference_pairs(boxes);
    expect_exact(flat, config(), answer);
    expect_exact(flat, flat, config(), reference_pairs(boxes, boxes));
  }
}

// A stride of 0 repeats one box.
TEST_P(View, StrideZero) {
  const Box box = cube(1, 2, 3, 4);
  const BoxList same(70, box);
  expect_exact(Boxes(&box, same.size(), 0), config(), reference_pairs(same));
}

TEST_P(View, TwoSetsInDifferentLayouts) {
  const BoxList a = snapped_boxes(300, 10, 1, 6), b = snapped_boxes(200, 10, 1, 7);
  const Columns columns(b);
  expect_exact(
      a,
      Boxes::arrays(columns.c[0].data(), columns.c[1].data(), columns.c[2].data(),
                    columns.c[3].data(), columns.c[4].data(), columns.c[5].data(), b.size()),
      config(), reference_pairs(a, b));
}

THRONG_INSTANTIATE(View, suite_configs);

}  // namespace
}  // namespace throng::tests
