// Boxes with lower > upper: find_pairs rejects them and names the likely mistake; Finder treats
// them as empty slots; an option swaps either behaviour.
#include <algorithm>

#include "support/configs.hpp"
#include "support/failing_resource.hpp"
#include "support/hard_boxes.hpp"
#include "support/same_bits.hpp"

namespace throng::tests {
namespace {

constexpr float quiet = std::numeric_limits<float>::quiet_NaN();

class Inverted : public Conformance {
 protected:
  Options with(InvertedPolicy policy) const {
    Options o = options();
    o.inverted = policy;
    return o;
  }
};

bool says(const Result& result, const std::string& text) {
  return std::string(result.message).find(text) != std::string::npos;
}

void expect_refused(const Result& result, std::uint64_t first, std::uint64_t count) {
  EXPECT_EQ(result.status, Status::inverted_box) << result.message;
  EXPECT_EQ(result.first_invalid, first);
  EXPECT_EQ(result.invalid_count, count);
  EXPECT_EQ(result.found, 0u);
  EXPECT_TRUE(says(result, std::to_string(count) + " of ")) << result.message;
  EXPECT_TRUE(says(result, "the first is box " + std::to_string(first))) << result.message;
  EXPECT_TRUE(says(result, "Options::inverted")) << result.message;
}

// Boxes far from the origin, so that each mistake shows in nearly all of them.
BoxList far_boxes(int n) {
  BoxList boxes = uniform_boxes(n, 4);
  for (Box& b : boxes) {
    b.lower = {b.lower.x + 900, b.lower.y + 500, b.lower.z + 1700};
    b.upper = {b.upper.x + 900, b.upper.y + 500, b.upper.z + 1700};
  }
  return boxes;
}

template <class Make>
BoxList each(BoxList boxes, const Make& make) {
  std::transform(boxes.begin(), boxes.end(), boxes.begin(), make);
  return boxes;
}
Box as_center_and_size(const Box& b) {
  const Vec3 size = {b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z};
  return {{b.lower.x + size.x / 2, b.lower.y + size.y / 2, b.lower.z + size.z / 2}, size};
}
// Half of them on either side of zero.
BoxList around_zero(const BoxList& boxes) {
  double sum[3] = {};
  for (const Box& b : boxes)
    for (int k = 0; k < 3; ++k) sum[k] += double{(&b.lower.x)[k]};
  return each(boxes, [&](Box b) {
    for (int k = 0; k < 6; ++k)
      (&b.lower.x)[k] -= static_cast<float>(sum[k % 3] / static_cast<double>(boxes.size()));
    return b;
  });
}
Box swapped(const Box& b) { return {b.upper, b.lower}; }
Box as_intervals(const Box& b) {
  return {{b.lower.x, b.upper.x, b.lower.y}, {b.upper.y, b.lower.z, b.upper.z}};
}

TEST_P(Inverted, TheShortFormRefusesByIndexAndCount) {
  const Options o = with(InvertedPolicy::automatic);
  for (const int n : {1, 2, 17, 3000}) {
    const BoxList good = uniform_boxes(n, 1);
    for (const std::size_t first :
         {std::size_t{0}, static_cast<std::size_t>(n) / 2, static_cast<std::size_t>(n) - 1}) {
      for (int axis = 0; axis < 3; ++axis) {
        BoxList boxes = good;
        std::uint64_t count = 0;
        for (std::size_t i = first; i < boxes.size(); i += 31, ++count) {
          float* const lower = &boxes[i].lower.x + axis;
          *lower = std::nextafter((&boxes[i].upper.x)[axis], infinity);
        }
        std::vector<Pair> out = {{5, 6}};
        expect_refused(find_pairs(boxes, out, o), first, count);
        EXPECT_TRUE(out.empty());
        const Result second = find_pairs(good, boxes, out, o);
        expect_refused(second, first, count);
        EXPECT_TRUE(says(second, "of the second set")) << second.message;
        const Result both = find_pairs(boxes, boxes, out, o);
        EXPECT_TRUE(says(both, "of the first set")) << both.message;
      }
    }
  }
  EXPECT_THROW((void)find_pairs(BoxList{swapped(cube(0, 0, 0, 1))}, o), Error);
}

TEST_P(Inverted, AnOptionAllowsEmptySlots) {
  for (const int n : {1, 40, 900}) {
    const BoxList boxes = with_inverted(n, 2), others = with_inverted(n, 3);
    std::vector<Pair> out;
    const Result one = find_pairs(boxes, out, with(InvertedPolicy::inactive));
    ASSERT_TRUE(one.ok()) << one.message;
    EXPECT_EQ(one.inactive, reference_pairs(boxes).inactive);
    EXPECT_TRUE(same_pairs(out, reference_pairs(boxes).pairs));
    out = find_pairs(boxes, others, with(InvertedPolicy::inactive));
    EXPECT_TRUE(same_pairs(out, reference_pairs(boxes, others).pairs));
  }
}

// A Finder accepts them by default, in every form, and rejects them if an option says so.
TEST_P(Inverted, AFinderKeepsThemUnlessSetOtherwise) {
  const BoxList boxes = with_inverted(700, 8);
  const Answer answer = reference_pairs(boxes);
  ASSERT_GT(answer.inactive, 0u);
  std::size_t first = 0;
  while (boxes[first].lower.x <= boxes[first].upper.x &&
         boxes[first].lower.y <= boxes[first].upper.y &&
         boxes[first].lower.z <= boxes[first].upper.z)
    ++first;
  std::vector<Pair> buffer(answer.pairs.size() + 1);
  std::uint64_t given = 0;
  const auto count_in = [&](const Pair*, std::size_t n) {
    given += n;
    return true;
  };
  Finder finder(with(InvertedPolicy::automatic));
  for (const Result& r : {finder.find(boxes), finder.find(boxes, buffer.data(), buffer.size()),
                          finder.consume(boxes, count_in)}) {
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.inactive, answer.inactive);
    EXPECT_EQ(r.found, answer.pairs.size());
  }
  EXPECT_EQ(given, answer.pairs.size());
  given = 0;
  finder.set_options(with(InvertedPolicy::refuse));
  for (const Result& r : {finder.find(boxes), finder.find(boxes, buffer.data(), buffer.size()),
                          finder.find(boxes, nullptr, 0), finder.consume(boxes, count_in)}) {
    expect_refused(r, first, answer.inactive);
  }
  EXPECT_EQ(finder.pairs().size(), 0u);
  EXPECT_EQ(given, 0u) << "a consumer received pairs of rejected boxes";
  const BoxList good = uniform_boxes(700, 8);
  const Result fine = finder.find(good);
  EXPECT_TRUE(fine.ok()) << fine.message;
  EXPECT_EQ(fine.found, reference_pairs(good).pairs.size());
}

// A box with a NaN counts as NaN, never as inverted.
TEST_P(Inverted, NanTakesPrecedence) {
  BoxList boxes = uniform_boxes(60, 1);
  boxes[20] = {{1, quiet, 0}, {0, 1, 1}};
  std::vector<Pair> out;
  Options o = with(InvertedPolicy::refuse);
  EXPECT_EQ(find_pairs(boxes, out, o).status, Status::nan_box);
  o.nan = NanPolicy::inactive;
  const Result r = find_pairs(boxes, out, o);
  ASSERT_TRUE(r.ok()) << r.message;
  EXPECT_EQ(r.inactive, 1u);
  boxes[40] = swapped(boxes[40]);
  expect_refused(find_pairs(boxes, out, o), 40, 1);
}

TEST_P(Inverted, TheLikelyMistakeIsNamed) {
  const Options o = with(InvertedPolicy::automatic);
  const BoxList good = far_boxes(500);
  std::vector<Pair> out;
  ASSERT_TRUE(find_pairs(good, out, o).ok());
  const auto message_of = [&](const BoxList& boxes) {
    const Result r = find_pairs(boxes, out, o);
    EXPECT_EQ(r.status, Status::inverted_box);
    EXPECT_LT(std::string(r.message).size() + 1, sizeof r.message) << "cut off";
    const Result other = find_pairs(good, boxes, out, o);
    EXPECT_NE(std::string(other.message).find("set Options::inverted to inactive"),
              std::string::npos)
        << other.message;
    return std::string(r.message);
  };
  const auto names = [](const std::string& message, const char* cause) {
    return message.find(cause) != std::string::npos;
  };
  // At large positive coordinates a size and a swapped corner look alike: both are named.
  const std::string sizes = message_of(each(good, as_center_and_size));
  EXPECT_TRUE(names(sizes, "looks like a size") && names(sizes, "swapped")) << sizes;
  const BoxList centred = around_zero(good);
  const std::string here = message_of(each(centred, as_center_and_size));
  EXPECT_TRUE(names(here, "box_from_center(center, size / 2)") && !names(here, "swapped")) << here;
  const std::string corners = message_of(each(centred, swapped));
  EXPECT_TRUE(names(corners, "look swapped") && !names(corners, "size")) << corners;
  const std::string order = message_of(each(good, as_intervals));
  EXPECT_TRUE(names(order, "xmin, xmax, ymin")) << order;
  // Some empty slots among valid boxes are no layout mistake, nor are single invalid ones.
  BoxList some = good;
  for (std::size_t i = 0; i < some.size(); i += 50) some[i] = swapped(some[i]);
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string message = message_of(some);
    for (const char* cause : {"looks", "look ", "xmin"})
      EXPECT_FALSE(names(message, cause)) << message;
    for (std::size_t i = 0; i < some.size(); i += 3)
      some[i] = {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  }
  // A third swapped at large positive coordinates, where each upper corner could be a size.
  some = good;
  for (std::size_t i = 0; i < some.size(); i += 3) some[i] = swapped(some[i]);
  const std::string third = message_of(some);
  EXPECT_FALSE(names(third, "size") || names(third, "look")) << third;
  // Valid boxes whose numbers also fit the interval layout.
  BoxList tall(100, Box{{0, 100, -5}, {1, 101, 200}});
  tall[60] = swapped(tall[60]);
  const std::string one = message_of(tall);
  EXPECT_FALSE(names(one, "xmin")) << one;
}

TEST_P(Inverted, OfTwoDimensions) {
  const BoxList good = far_boxes(300);
  std::vector<float> part[4];
  for (const Box& b : good) {  // intervals x, y, where lower x, y, upper x, y is expected
    part[0].push_back(b.lower.x);
    part[1].push_back(b.upper.x);
    part[2].push_back(b.lower.y);
    part[3].push_back(b.upper.y);
  }
  const auto view = [&](int lower_x, int lower_y, int upper_x, int upper_y) {
    return Boxes::arrays(part[lower_x].data(), part[lower_y].data(), nullptr, part[upper_x].data(),
                         part[upper_y].data(), nullptr, good.size());
  };
  std::vector<Pair> out;
  const Options o = with(InvertedPolicy::automatic);
  EXPECT_TRUE(find_pairs(view(0, 2, 1, 3), out, o).ok());
  const Result r = find_pairs(view(0, 1, 2, 3), out, o);
  EXPECT_EQ(r.status, Status::inverted_box);
  EXPECT_TRUE(says(r, "xmin, xmax, ymin")) << r.message;
  // Lower corners and sizes: either is the greater equally often.
  std::vector<float> size[2];
  for (std::size_t i = 0; i < good.size(); ++i) {
    size[0].push_back(size[0].size() % 2 ? 1.0f : 2.0f);
    size[1].push_back(size[1].size() % 2 ? 2.0f : 1.0f);
  }
  const Boxes sized = Boxes::arrays(part[2].data(), part[0].data(), nullptr, size[0].data(),
                                    size[1].data(), nullptr, good.size());
  const Result of_sizes = find_pairs(sized, out, o);
  EXPECT_TRUE(says(of_sizes, "size") && !says(of_sizes, "xmin")) << of_sizes.message;
}

// A mistaken layout can have more pairs than memory holds; the error then names the mistake.
TEST(InvertedMemory, TheMistakeIsNamedWhereMemoryRunsOut) {
  FailingResource memory;
  Options options;
  options.memory = &memory;
  options.inverted = InvertedPolicy::refuse;
  BoxList boxes = uniform_boxes(50, 1);
  for (const bool inverted : {false, true}) {
    if (inverted) boxes[9] = swapped(boxes[9]);
    Finder finder(options);
    memory.fail(0, true);
    const Result r = finder.find(boxes);
    memory.calm();
    EXPECT_EQ(r.status, inverted ? Status::inverted_box : Status::out_of_memory) << r.message;
  }
}

THRONG_INSTANTIATE(Inverted, all_configs);

TEST(InvertedDoubles, AreRefusedByTheShortForm) {
  std::vector<DoubleBox> boxes = {{{0, 0, 0}, {1, 1, 1}}, {{1, 1, 1}, {2, 2, 2}}};
  std::vector<Pair> out;
  EXPECT_TRUE(find_pairs(boxes, out).ok());
  EXPECT_EQ(out.size(), 1u);
  // By less than float resolution.
  boxes[1].lower.y = std::nextafter(2.0, 3.0);
  const Result r = find_pairs(boxes, out);
  expect_refused(r, 1, 1);
  EXPECT_TRUE(out.empty());
  const Result second = find_pairs(DoubleBoxes(boxes.data(), 1), boxes, out);
  expect_refused(second, 1, 1);
  EXPECT_TRUE(says(second, "second set")) << second.message;
  Finder finder;
  const Result kept = finder.find(DoubleBoxes(boxes));
  EXPECT_TRUE(kept.ok());
  EXPECT_EQ(kept.inactive, 1u);
}

TEST(BoxFromCenter, IsTheSmallestFloatBoxAround) {
  const Box exact = box_from_center({1, 2, 3}, {0.5f, 1, 1.5f});
  EXPECT_TRUE(same_bits(exact, Box{{0.5f, 1, 1.5f}, {1.5f, 3, 4.5f}}));
  // 1 - 2^-60 is no float: lower is rounded down, upper up.
  const Box tight = box_from_center({1, 1, -1}, {0x1p-60f, 0, 0x1p-60f});
  EXPECT_EQ(tight.lower.x, std::nextafter(1.0f, 0.0f));
  EXPECT_EQ(tight.upper.x, std::nextafter(1.0f, 2.0f));
  EXPECT_EQ(tight.lower.y, 1.0f);
  EXPECT_EQ(tight.upper.y, 1.0f);
  EXPECT_EQ(tight.lower.z, std::nextafter(-1.0f, -2.0f));
  EXPECT_EQ(tight.upper.z, std::nextafter(-1.0f, 0.0f));
  const Box plane = box_from_center({0, 5, 0}, {infinity, 1, infinity});
  EXPECT_TRUE(same_bits(plane, Box{{-infinity, 4, -infinity}, {infinity, 6, infinity}}));
  const Vec3 centers[] = {{1, 2, 3}, {0, 5, 0}},
             halves[] = {{0.5f, 1, 1.5f}, {infinity, 1, infinity}};
  const std::vector<Box> boxes = boxes_from_center(centers, halves, 2);
  ASSERT_EQ(boxes.size(), 2u);
  EXPECT_TRUE(same_bits(boxes[0], exact));
  EXPECT_TRUE(same_bits(boxes[1], plane));
}

}  // namespace
}  // namespace throng::tests
