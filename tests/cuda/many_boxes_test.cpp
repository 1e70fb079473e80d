// So many boxes that they are sorted by cell (device/cell_sort.hpp), against the CPU. A build
// with -DTHRONG_GPU_SORTED_ABOVE=0 sorts any number.
#include "cuda/gpu_fixture.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class GpuMany : public OnGpu {
 protected:
  void SetUp() override {
    OnGpu::SetUp();
    if (GetParam().algorithm != Algorithm::grid || GetParam().own_stream)
      GTEST_SKIP() << "same as other settings, or too slow";
  }
};

constexpr int many = 4'001'793;  // a tile of 2048, and one box more

Answer by_cpu(const Boxes& a, const Boxes* b, float margin) {
  Options o;
  o.order = Order::canonical;
  o.nan = NanPolicy::inactive;
  o.margin = margin;
  Finder finder(o);
  const Result r = b ? finder.find(a, *b) : finder.find(a);
  EXPECT_TRUE(r.ok()) << r.message;
  return {to_vector(finder.pairs()), r.inactive};
}

TEST_P(GpuMany, InactiveOnes) {
  static const BoxList list = [] {
    BoxList boxes = uniform_boxes(many, 5);
    for (std::size_t i = 100; i < boxes.size(); i += 7) std::swap(boxes[i].lower, boxes[i].upper);
    for (std::size_t i = 41; i < boxes.size(); i += 1001) boxes[i].upper.y = std::nanf("");
    return boxes;
  }();
  static const Answer answer = by_cpu(list, nullptr, 0);
  Options allowing = options();
  allowing.nan = NanPolicy::inactive;
  cuda::Finder finder(allowing);
  const OnDevice<Box> boxes(list);
  expect_answer(finder, view(boxes), nullptr, answer);
}

TEST_P(GpuMany, TwoSetsWithWorldsAndAMargin) {
  static const BoxList list = uniform_boxes(many / 2, 6), other = uniform_boxes(many - many / 2, 7);
  std::vector<std::int32_t> worlds;
  for (std::size_t i = 0; i < list.size(); ++i) worlds.push_back(static_cast<int>(i % 5) - 1);
  Boxes host = list;
  host.filters.world = {worlds.data(), worlds.size()};
  Boxes other_host = other;
  other_host.filters.world = {worlds.data() + 1, other.size(), 0};  // all of one world
  Options wide = options();
  wide.margin = 0.1f;
  static const Answer answer = by_cpu(host, &other_host, wide.margin);
  cuda::Finder finder(wide);
  const OnDevice<Box> boxes(list), others(other);
  const OnDevice<std::int32_t> there(worlds);
  Boxes device = view(boxes), other_device = view(others);
  device.filters.world = {there.data(), there.size()};
  other_device.filters.world = {there.data() + 1, others.size(), 0};
  expect_answer(finder, device, &other_device, answer);
}

// One cell contains all boxes; no two of them are a pair.
TEST_P(GpuMany, AllAlike) {
  const BoxList one = {cube(1, 2, 3, 4)};
  const OnDevice<Box> box(one);
  const OnDevice<std::uint8_t> still(std::vector<std::uint8_t>{1});
  cuda::Finder finder(options());
  for (const int n : {4'000'001, many - 2, many - 1, many}) {
    Boxes boxes(box.data(), static_cast<std::size_t>(n), 0);
    boxes.filters.is_static = {still.data(), boxes.size(), 0};
    const PairBuffer buffer(1);
    const Result r = finder.find(boxes, buffer.out(), buffer.capacity(), stream());
    EXPECT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.found, 0u);
    EXPECT_EQ(r.inactive, 0u);
  }
}

THRONG_INSTANTIATE_GPU(GpuMany);

}  // namespace
}  // namespace throng::tests
