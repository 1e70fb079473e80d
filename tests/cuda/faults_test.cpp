// Errors on a device are reported in the message, and the Finder works afterwards.
#include "cuda/gpu_fixture.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class GpuFaults : public OnGpu {
 protected:
  // The Finder still returns the correct result.
  void expect_works(cuda::Finder& finder, int n = 1000) {
    const BoxList list = uniform_boxes(n, 9);
    const OnDevice<Box> boxes(list);
    expect_answer(finder, view(boxes), nullptr, reference_pairs(list));
  }
  static void expect_says(const Result& r, Status status, const std::string& words) {
    EXPECT_EQ(r.status, status) << r.message;
    EXPECT_NE(std::string(r.message).find(words), std::string::npos) << r.message;
    EXPECT_EQ(r.written, 0u);
  }
};

TEST_P(GpuFaults, HostPointersAreRefused) {
  const BoxList list = uniform_boxes(500, 1);
  const OnDevice<Box> boxes(list);
  const PairBuffer buffer(10000);
  std::vector<Pair> host_pairs(10000);
  const std::vector<std::int32_t> owners(500, 1);
  cuda::Report host_report;
  const OnDevice<cuda::Report> report(1);
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(1000, 10000, stream()).ok());
  expect_says(finder.find(list, buffer.out(), buffer.capacity(), stream()), Status::bad_boxes,
              "host memory");
  expect_says(finder.find(view(boxes), list, buffer.out(), buffer.capacity(), stream()),
              Status::bad_boxes, "host memory");
  expect_says(finder.find(view(boxes), host_pairs.data(), 10000, stream()), Status::bad_option,
              "host memory");
  Boxes filtered = view(boxes);
  filtered.filters.owner = {owners.data(), owners.size()};
  expect_says(finder.find(filtered, buffer.out(), buffer.capacity(), stream()), Status::bad_filter,
              "host memory");
  expect_says(finder.find_async(list, buffer.out(), buffer.capacity(), report.data(), stream()),
              Status::bad_boxes, "host memory");
  expect_says(
      finder.find_async(view(boxes), buffer.out(), buffer.capacity(), &host_report, stream()),
      Status::bad_option, "report");
  expect_says(finder.find_async(view(boxes), buffer.out(), buffer.capacity(), nullptr, stream()),
              Status::bad_option, "report");
  buffer.take(0);
  expect_works(finder);
}

// Device memory that is misaligned for floats or 64-bit integers.
TEST_P(GpuFaults, MisalignedPointersAreRefused) {
  const BoxList list = uniform_boxes(500, 1);
  const OnDevice<Box> boxes(501);
  const OnDevice<std::int32_t> owners(501);
  const OnDevice<cuda::Report> report(2);
  const PairBuffer buffer(10000);
  const auto misaligned = [](auto* p, std::size_t bytes) {
    return reinterpret_cast<decltype(p)>(reinterpret_cast<std::uintptr_t>(p) + bytes);
  };
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(1000, 10000, stream()).ok());
  const Boxes good(boxes.data(), 500);
  for (const std::size_t bytes : {1, 2, 3}) {
    const Boxes shifted(misaligned(boxes.data(), bytes), 500);
    expect_says(finder.find(shifted, buffer.out(), buffer.capacity(), stream()), Status::bad_boxes,
                "a coordinate array is not aligned");
    expect_says(finder.find(good, shifted, buffer.out(), buffer.capacity(), stream()),
                Status::bad_boxes, "not aligned");
    const auto* p = reinterpret_cast<const float*>(boxes.data());
    const Boxes one_of_six = Boxes::arrays(p, p, p, p, p, misaligned(p, bytes), 500);
    expect_says(finder.find(one_of_six, buffer.out(), buffer.capacity(), stream()),
                Status::bad_boxes, "not aligned");
    Boxes filtered = good;
    filtered.filters.owner = {misaligned(owners.data(), bytes), 500};
    expect_says(finder.find(filtered, buffer.out(), buffer.capacity(), stream()),
                Status::bad_filter, "filter 'owner' is not aligned");
    expect_says(finder.find(good, misaligned(buffer.out(), bytes), 9000, stream()),
                Status::bad_option, "the output is not aligned");
  }
  Boxes filtered = good;
  filtered.filters.owner = {owners.data(), 500, 6};
  expect_says(finder.find(filtered, buffer.out(), buffer.capacity(), stream()), Status::bad_filter,
              "the stride of filter 'owner'");
  expect_says(finder.find_async(good, buffer.out(), 9000, misaligned(report.data(), 4), stream()),
              Status::bad_option, "the report is not aligned");
  buffer.take(0);
  expect_works(finder);
}

constexpr float quiet = std::numeric_limits<float>::quiet_NaN();

TEST_P(GpuFaults, NanIsRefusedByIndexAndCount) {
  cuda::Finder finder(options());
  for (const int n : {1, 40, 6000}) {
    SCOPED_TRACE(n);
    const BoxList good = uniform_boxes(n, 1);
    BoxList list = good;
    const std::size_t first = list.size() / 2;
    std::size_t count = 0;
    for (std::size_t i = first; i < list.size(); i += 13, ++count)
      (&list[i].lower.x)[count % 6] = count % 2 ? quiet : -quiet;
    const OnDevice<Box> boxes(list), others(good);
    const PairBuffer buffer(100000);
    const auto expect_refused = [&](const Result& r, const char* set) {
      expect_says(r, Status::nan_box, std::to_string(first));
      expect_says(r, Status::nan_box, set);
      EXPECT_EQ(r.first_invalid, first);
      EXPECT_EQ(r.invalid_count, count);
    };
    expect_refused(finder.find(view(boxes), buffer.out(), buffer.capacity(), stream()), "box");
    expect_refused(
        finder.find(view(boxes), view(others), buffer.out(), buffer.capacity(), stream()),
        "first set");
    expect_refused(
        finder.find(view(others), view(boxes), buffer.out(), buffer.capacity(), stream()),
        "second set");
  }
  expect_works(finder);
}

TEST_P(GpuFaults, NanAndInvertedAreInactiveIfAllowed) {
  Options with = options();
  with.nan = NanPolicy::inactive;
  cuda::Finder finder(with);
  for (const int n : {1, 33, 700, 6000}) {
    SCOPED_TRACE(n);
    BoxList list = with_inverted(n, 2);
    for (std::size_t i = 0; i < list.size(); i += 5) (&list[i].lower.x)[i % 6] = quiet;
    const OnDevice<Box> boxes(list);
    expect_answer(finder, view(boxes), nullptr, reference_pairs(list));
  }
}

TEST_P(GpuFaults, AWorldBelowMinusOneIsReported) {
  const BoxList list = uniform_boxes(5000, 1);
  std::vector<std::int32_t> worlds(list.size(), 3);
  worlds[4000] = -2;
  worlds[4711] = std::numeric_limits<std::int32_t>::min();
  const OnDevice<Box> boxes(list);
  OnDevice<std::int32_t> there(worlds);
  Boxes filtered = view(boxes);
  filtered.filters.world = {there.data(), worlds.size()};
  const PairBuffer buffer(100000);
  cuda::Finder finder(options());
  const Result r = finder.find(filtered, buffer.out(), buffer.capacity(), stream());
  expect_says(r, Status::bad_filter, "4000");
  EXPECT_EQ(r.first_invalid, 4000u);
  EXPECT_EQ(r.invalid_count, 2u);
  worlds[4000] = worlds[4711] = -1;
  there.put(worlds);
  Boxes host(list);
  host.filters.world = {worlds.data(), worlds.size()};
  expect_answer(finder, filtered, nullptr, reference_pairs(host));
}

// Each allocation fails in turn; the earlier memory remains usable.
TEST_P(GpuFaults, MemoryRunsShort) {
  CountingDeviceMemory memory;
  cuda::Finder finder(options(), memory.resource());
  memory.limit(0);
  Result r = finder.reserve(1000, 10000, stream());
  expect_says(r, Status::out_of_memory, "bytes failed (by the MemoryResource)");
  EXPECT_GT(r.bytes_needed, 0u);
  memory.limit(~std::size_t{0});
  ASSERT_TRUE(finder.reserve(1000, 10000, stream()).ok());
  expect_works(finder);
  // More boxes and more pairs than fit; each step allows one more block.
  for (const std::size_t more :
       {std::size_t{0}, std::size_t{1} << 20, std::size_t{6} << 20, std::size_t{10} << 20}) {
    SCOPED_TRACE(more);
    memory.limit(memory.held() + more);
    EXPECT_EQ(finder.reserve(1000000, 0, stream()).status, Status::out_of_memory);
    EXPECT_EQ(finder.reserve(1000, 1000000, stream()).status, Status::out_of_memory);
    memory.limit(~std::size_t{0});
    expect_works(finder);
    expect_works(finder, 900);
  }
  memory.limit(memory.held());
  const BoxList list = uniform_boxes(200000, 3);
  const OnDevice<Box> boxes(list);
  const PairBuffer buffer(10);
  expect_says(finder.find(view(boxes), buffer.out(), 10, stream()), Status::out_of_memory, "bytes");
  memory.limit(~std::size_t{0});
  expect_works(finder);
}

// One byte less than a call needs, and exactly enough.
TEST_P(GpuFaults, MemoryShortByAByte) {
  const BoxList list = uniform_boxes(3000, 4);
  const OnDevice<Box> boxes(list);
  const Answer answer = reference_pairs(list);
  const PairBuffer buffer(answer.pairs.size());
  const auto call = [&](cuda::Finder& finder) {
    return finder.find(view(boxes), buffer.out(), buffer.capacity(), stream());
  };
  std::size_t taken = 0;
  {
    cuda::Finder finder(options());
    ASSERT_TRUE(call(finder).ok());
    taken = finder.memory_bytes();
  }
  CountingDeviceMemory memory;
  memory.limit(taken - 1);
  cuda::Finder finder(options(), memory.resource());
  expect_says(call(finder), Status::out_of_memory, "bytes failed");
  memory.limit(taken);
  expect_answer(finder, view(boxes), nullptr, answer);
  EXPECT_EQ(memory.held(), taken);
}

// CUDA's message for a block that no device has.
TEST_P(GpuFaults, CudaMessagesAreKept) {
  cuda::Finder finder(options());
  const Result r = finder.reserve(1000, std::size_t{1} << 45, stream());
  expect_says(r, Status::out_of_memory, "bytes failed (out of memory); free some");
  EXPECT_GT(r.bytes_needed, std::size_t{1} << 45);
  EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "the call left a CUDA error behind";
  expect_works(finder);
}

TEST_P(GpuFaults, AFinderMoves) {
  CountingDeviceMemory memory;
  cuda::Finder one(options(), memory.resource());
  expect_works(one);
  const std::size_t bytes = one.memory_bytes();
  EXPECT_GT(bytes, 0u);
  cuda::Finder two(std::move(one));
  EXPECT_EQ(two.memory_bytes(), bytes);
  expect_works(two);
  cuda::Finder three(options());
  expect_works(three);
  three = std::move(two);
  expect_works(three);
  EXPECT_EQ(memory.held(), three.memory_bytes());
}

// The current device stays current.
TEST_P(GpuFaults, TheCurrentDeviceIsLeftAlone) {
  int before = -1, after = -2;
  check_cuda(cudaGetDevice(&before));
  cuda::Finder finder(options());
  expect_works(finder);
  check_cuda(cudaGetDevice(&after));
  EXPECT_EQ(before, after);
  EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "the call left a CUDA error behind";
}

THRONG_INSTANTIATE_GPU(GpuFaults);

}  // namespace
}  // namespace throng::tests
