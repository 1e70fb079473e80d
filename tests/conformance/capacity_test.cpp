// The caller's buffer: nothing past its end, the exact total, valid pairs up to `written`.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Capacity : public Conformance {};

constexpr std::size_t guard = 64;
constexpr Pair untouched{0xabababab, 0xcdcdcdcd};

struct Buffer {
  explicit Buffer(std::size_t size) : capacity(size), memory(size + 2 * guard, untouched) {}
  Pair* out() { return memory.data() + guard; }
  bool guards_hold() const {
    for (std::size_t i = 0; i < guard; ++i)
      if (memory[i] != untouched || memory[memory.size() - 1 - i] != untouched) return false;
    return true;
  }
  std::vector<Pair> first(std::size_t count) const {
    const auto begin = memory.begin() + static_cast<std::ptrdiff_t>(guard);
    return {begin, begin + static_cast<std::ptrdiff_t>(count)};
  }
  std::size_t capacity;
  std::vector<Pair> memory;
};

void expect_buffer(const Result& result, const Buffer& buffer, const Config& config,
                   const Answer& answer) {
  EXPECT_TRUE(buffer.guards_hold()) << "written outside of the buffer";
  EXPECT_EQ(result.found, answer.pairs.size());
  EXPECT_EQ(result.inactive, answer.inactive);
  ASSERT_LE(result.written, buffer.capacity);
  std::vector<Pair> got = buffer.first(result.written);
  if (answer.pairs.size() <= buffer.capacity) {
    EXPECT_EQ(result.status, Status::ok) << result.message;
    if (config.order == Order::canonical) {
      EXPECT_TRUE(got == answer.pairs);
    }
    EXPECT_TRUE(same_pairs(std::move(got), answer.pairs));
    return;
  }
  EXPECT_EQ(result.status, Status::buffer_too_small);
  EXPECT_NE(std::string(result.message).find(std::to_string(answer.pairs.size())),
            std::string::npos)
      << "the message does not name the capacity needed: " << result.message;
  if (config.order == Order::canonical) {
    EXPECT_EQ(result.written, 0u);
    for (const Pair& pair : buffer.memory)
      ASSERT_TRUE(pair == untouched) << "written although too small";
    return;
  }
  std::sort(got.begin(), got.end());
  EXPECT_TRUE(std::adjacent_find(got.begin(), got.end()) == got.end()) << "a pair reported twice";
  EXPECT_TRUE(std::includes(answer.pairs.begin(), answer.pairs.end(), got.begin(), got.end()))
      << "a pair that does not overlap";
}

TEST_P(Capacity, EveryCapacity) {
  const BoxList scenes[] = {uniform_boxes(1500, 1),      identical_boxes(100, 2),
                            snapped_boxes(700, 8, 1, 3), infinite_bounds(500, 4),
                            uniform_boxes(2, 1),         identical_boxes(2, 1)};
  for (const BoxList& boxes : scenes) {
    const Answer answer = reference_pairs(boxes);
    const std::size_t found = answer.pairs.size();
    Finder finder(options());
    for (const std::size_t capacity : {std::size_t{0}, std::size_t{1}, found / 2,
                                       found - (found > 0), found, found + 1, found + 1000}) {
      SCOPED_TRACE(std::to_string(capacity) + " of " + std::to_string(found));
      Buffer buffer(capacity);
      const Result result = finder.find(boxes, buffer.out(), capacity);
      expect_buffer(result, buffer, config(), answer);
    }
  }
}

// Enough pairs that several threads write into pieces of the buffer, and leave some of them half
// empty at the end.
TEST_P(Capacity, EveryCapacityManyPairs) {
  static const BoxList boxes = [] {
    Random random(7);
    BoxList all(6500);
    for (Box& box : all) {
      const Vec3 at = random.point(0, 12);
      box = cube(at.x, at.y, at.z, 1);
    }
    return all;
  }();
  static const Answer answer = swept_pairs(boxes);
  const std::size_t found = answer.pairs.size();
  ASSERT_GT(found, 60000u);
  Finder finder(options());
  for (const std::size_t capacity : {found / 3, found - 1, found, found + 700, 2 * found}) {
    SCOPED_TRACE(std::to_string(capacity) + " of " + std::to_string(found));
    Buffer buffer(capacity);
    const Result result = finder.find(boxes, buffer.out(), capacity);
    expect_buffer(result, buffer, config(), answer);
    if (config().order == Order::any) {
      EXPECT_EQ(result.written, std::min(capacity, found));
    }
  }
  for (int again = 0; again < 2; ++again) {
    const Result grown = finder.find(boxes);
    expect_pairs(grown, config(), answer, to_vector(finder.pairs()), boxes.size());
  }
  std::vector<Pair> out;
  const Result result = find_pairs(boxes, out, options());
  expect_pairs(result, config(), answer, out, boxes.size());
}

// More pairs than the estimate for these boxes, and more than any estimate: from a Finder, into an
// empty vector, and into one with some capacity.
TEST_P(Capacity, MoreThanEstimated) {
  for (const std::size_t count : {std::size_t{150}, std::size_t{420}}) {
    const BoxList boxes = identical_boxes(count, 3);
    const Answer answer = reference_pairs(boxes);
    ASSERT_EQ(answer.pairs.size(), count * (count - 1) / 2);
    Finder finder(options());
    const Result own = finder.find(boxes);
    expect_pairs(own, config(), answer, to_vector(finder.pairs()), count);
    for (const std::size_t capacity : {0, 9}) {
      std::vector<Pair> out(capacity, untouched);
      const Result result = find_pairs(boxes, out, options());
      expect_pairs(result, config(), answer, out, count);
    }
  }
}

TEST_P(Capacity, EveryCapacityTwoSets) {
  const BoxList a = uniform_boxes(1500, 1), b = uniform_boxes(1200, 2);
  const Answer answer = reference_pairs(a, b);
  const std::size_t found = answer.pairs.size();
  ASSERT_GT(found, 100u);
  Finder finder(options());
  for (const std::size_t capacity : {std::size_t{0}, std::size_t{1}, found - 1, found, found + 1}) {
    SCOPED_TRACE(std::to_string(capacity) + " of " + std::to_string(found));
    Buffer buffer(capacity);
    const Result result = finder.find(a, b, buffer.out(), capacity);
    expect_buffer(result, buffer, config(), answer);
  }
}

// With a capacity of 0 the buffer may be null.
TEST_P(Capacity, CountingOnly) {
  const BoxList boxes = uniform_boxes(1000, 5);
  const Answer answer = reference_pairs(boxes);
  Finder finder(options());
  const Result result = finder.find(boxes, nullptr, 0);
  EXPECT_EQ(result.status, Status::buffer_too_small);
  EXPECT_EQ(result.found, answer.pairs.size());
  EXPECT_EQ(result.written, 0u);
  const Result none = finder.find(Boxes(), nullptr, 0);
  EXPECT_EQ(none.status, Status::ok) << "no pairs fit a capacity of 0";
}

// After a buffer that was too small the same Finder finds all.
TEST_P(Capacity, RecoversFromTooSmall) {
  const BoxList boxes = snapped_boxes(900, 12, 1, 3);
  const Answer answer = reference_pairs(boxes);
  Finder finder(options());
  Buffer small(3);
  const Result first = finder.find(boxes, small.out(), 3);
  ASSERT_EQ(first.status, Status::buffer_too_small);
  Buffer right(first.found);
  expect_buffer(finder.find(boxes, right.out(), first.found), right, config(), answer);
  const Result grown = finder.find(boxes);
  expect_pairs(grown, config(), answer, to_vector(finder.pairs()), boxes.size());
}

TEST_P(Capacity, VectorForms) {
  const BoxList a = uniform_boxes(800, 1), b = uniform_boxes(500, 2);
  const Answer one = reference_pairs(a), two = reference_pairs(a, b);
  EXPECT_TRUE(same_pairs(find_pairs(a, options()), one.pairs));
  EXPECT_TRUE(same_pairs(find_pairs(a, b, options()), two.pairs));
  std::vector<Pair> out(7, untouched);
  const Result result = find_pairs(a, out, options());
  expect_pairs(result, config(), one, out, a.size());
  const Result second = find_pairs(a, b, out, options());
  expect_pairs(second, config(), two, out, b.size());
  EXPECT_TRUE(find_pairs(Boxes(), out, options()).ok());
  EXPECT_TRUE(out.empty()) << "the contents of the vector are replaced";
}

THRONG_INSTANTIATE(Capacity, suite_configs);

}  // namespace
}  // namespace throng::tests
