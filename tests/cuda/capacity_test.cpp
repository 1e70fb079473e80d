// The caller's buffer on the device: nothing is written past its end, the total is exact, and the
// pairs in it are valid.
#include "cuda/gpu_fixture.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class GpuCapacity : public OnGpu {
 protected:
  // Checks the buffer after a call that reported `found`.
  void expect_buffer(const PairBuffer& buffer, std::uint64_t found, const Answer& answer) {
    const std::size_t total = answer.pairs.size();
    EXPECT_EQ(found, total);
    std::size_t written = std::min(total, buffer.capacity());
    if (canonical() && total > buffer.capacity()) written = 0;  // nothing is written at all
    const std::vector<Pair> got = buffer.take(written);
    if (written == total) {
      if (canonical()) {
        EXPECT_TRUE(got == answer.pairs);
      }
      EXPECT_TRUE(same_pairs(got, answer.pairs));
      return;
    }
    std::vector<Pair> sorted = got;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_TRUE(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end())
        << "reported twice";
    EXPECT_TRUE(
        std::includes(answer.pairs.begin(), answer.pairs.end(), sorted.begin(), sorted.end()))
        << "a wrong pair or an unwritten entry";
  }
};

std::vector<std::size_t> capacities_for(std::size_t found) {
  return {0, 1, found / 2, found - (found > 0), found, found + 1, found + 1000};
}

TEST_P(GpuCapacity, EveryCapacity) {
  const BoxList scenes[] = {uniform_boxes(1500, 1),      identical_boxes(100, 2),
                            snapped_boxes(700, 8, 1, 3), infinite_bounds(500, 4),
                            uniform_boxes(9000, 5),      uniform_boxes(1, 1),
                            uniform_boxes(2, 1),         identical_boxes(2, 1)};
  cuda::Finder finder(options());
  for (const BoxList& list : scenes) {
    const Answer answer = reference_pairs(list);
    const OnDevice<Box> boxes(list);
    for (const std::size_t capacity : capacities_for(answer.pairs.size())) {
      SCOPED_TRACE(std::to_string(capacity) + " of " + std::to_string(answer.pairs.size()));
      const PairBuffer buffer(capacity);
      const Result r = finder.find(view(boxes), buffer.out(), capacity, stream());
      expect_buffer(buffer, r.found, answer);
      const bool fits = answer.pairs.size() <= capacity;
      EXPECT_EQ(r.status, fits ? Status::ok : Status::buffer_too_small) << r.message;
      EXPECT_EQ(r.written, fits ? r.found : canonical() ? 0 : std::uint64_t{capacity});
      EXPECT_EQ(std::string(r.message).find(std::to_string(r.found)) != std::string::npos, !fits)
          << "the message gives the required capacity: " << r.message;
    }
  }
}

TEST_P(GpuCapacity, EveryCapacityOfTwoSetsAsync) {
  const BoxList a = uniform_boxes(3000, 1), b = uniform_boxes(2500, 2);
  const Answer answer = reference_pairs(a, b);
  ASSERT_GT(answer.pairs.size(), 100u);
  const OnDevice<Box> first(a), second(b);
  const OnDevice<cuda::Report> report(1);
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(a.size() + b.size(), answer.pairs.size() + 1000, stream()).ok());
  for (const std::size_t capacity : capacities_for(answer.pairs.size())) {
    SCOPED_TRACE(std::to_string(capacity) + " of " + std::to_string(answer.pairs.size()));
    const PairBuffer buffer(capacity);
    const Result r = finder.find_async(view(first), view(second), buffer.out(), capacity,
                                       report.data(), stream());
    ASSERT_TRUE(r.ok()) << r.message;
    expect_buffer(buffer, report.get()[0].found, answer);
  }
}

// Into the Finder's own memory: it grows, is allocated once, and holds the last result.
TEST_P(GpuCapacity, Growing) {
  CountingDeviceMemory memory;
  cuda::Finder finder(options(), memory.resource());
  const auto pairs_of = [&] {
    check_cuda(cudaDeviceSynchronize());
    std::vector<Pair> got(finder.pairs().size());
    if (!got.empty())
      check_cuda(cudaMemcpy(got.data(), finder.pairs().data(), got.size() * sizeof(Pair),
                            cudaMemcpyDeviceToHost));
    return got;
  };
  const auto expect_found = [&](const Result& r, const Answer& answer) {
    EXPECT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.found, answer.pairs.size());
    EXPECT_EQ(r.written, answer.pairs.size());
    const std::vector<Pair> got = pairs_of();
    if (canonical()) {
      EXPECT_TRUE(got == answer.pairs);
    }
    EXPECT_TRUE(same_pairs(got, answer.pairs));
  };
  // Far more pairs than the first guess, then fewer.
  for (const BoxList& list : {uniform_boxes(3000, 1), identical_boxes(900, 2), BoxList{},
                              uniform_boxes(2000, 4), uniform_boxes(1, 1)}) {
    const OnDevice<Box> boxes(list);
    const Answer answer = reference_pairs(list);
    expect_found(finder.find(view(boxes), stream()), answer);
    const std::size_t before = memory.allocations();
    expect_found(finder.find(view(boxes), stream()), answer);
    EXPECT_EQ(memory.allocations(), before) << "the second call of this size allocates nothing";
    EXPECT_EQ(memory.held(), finder.memory_bytes());
  }
  const BoxList a = uniform_boxes(1100, 1), b = uniform_boxes(900, 2);
  const OnDevice<Box> first(a), second(b);
  expect_found(finder.find(view(first), view(second), stream()), reference_pairs(a, b));
  const std::size_t found = finder.pairs().size();
  cuda::Finder moved(std::move(finder));
  EXPECT_EQ(moved.pairs().size(), found);
  EXPECT_EQ(finder.pairs().size(), 0u);
  // A failed call leaves no pairs.
  EXPECT_EQ(moved.find(a, stream()).status, Status::bad_boxes);
  EXPECT_EQ(moved.pairs().size(), 0u);
}

// With no capacity, the buffer may be null.
TEST_P(GpuCapacity, CountingOnly) {
  const BoxList list = uniform_boxes(5000, 5);
  const OnDevice<Box> boxes(list);
  cuda::Finder finder(options());
  const Result r = finder.find(view(boxes), nullptr, 0, stream());
  EXPECT_EQ(r.status, Status::buffer_too_small);
  EXPECT_EQ(r.found, reference_pairs(list).pairs.size());
  EXPECT_EQ(r.written, 0u);
  EXPECT_EQ(finder.find(Boxes(), nullptr, 0, stream()).status, Status::ok);
}

// Far more pairs than boxes: every flush of the search ends past the capacity.
TEST_P(GpuCapacity, ManyPairsSmallBuffer) {
  const BoxList list = identical_boxes(1500, 3);
  const Answer answer = reference_pairs(list);
  ASSERT_GT(answer.pairs.size(), 1000000u);
  const OnDevice<Box> boxes(list);
  cuda::Finder finder(options());
  for (const std::size_t capacity : {std::size_t{1000}, std::size_t{255}, answer.pairs.size()}) {
    const PairBuffer buffer(capacity);
    const Result r = finder.find(view(boxes), buffer.out(), capacity, stream());
    expect_buffer(buffer, r.found, answer);
  }
}

// More pairs than 32 bits can count.
TEST_P(GpuCapacity, MoreThan32Bits) {
  constexpr std::uint64_t n = 100000;
  const OnDevice<Box> boxes(identical_boxes(static_cast<int>(n), 3));
  cuda::Finder finder(options());
  const PairBuffer buffer(1000);
  const Result r = finder.find(view(boxes), buffer.out(), buffer.capacity(), stream());
  EXPECT_EQ(r.status, Status::buffer_too_small);
  EXPECT_EQ(r.found, n * (n - 1) / 2);
  EXPECT_GE(r.comparisons, r.found);
  EXPECT_NE(std::string(r.message).find(std::to_string(n * (n - 1) / 2)), std::string::npos)
      << r.message;
  buffer.take(canonical() ? 0 : buffer.capacity());
}

THRONG_INSTANTIATE_GPU(GpuCapacity);

}  // namespace
}  // namespace throng::tests
