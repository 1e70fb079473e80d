// Counts near 32 and 64 bits, without the memory for them: requested sizes and counters must not
// wrap around.
#include <gtest/gtest.h>

#include <throng/types.hpp>

#include "base/memory.hpp"
#include "grid/emit/pair_sink.hpp"
#include "grid/recursion_scratch.hpp"
#include "grid/sweep/kernel_table.hpp"
#include "support/counting_resource.hpp"

namespace throng::grid {
namespace {

constexpr std::size_t all_ones = static_cast<std::size_t>(-1);

// Records the last requested size and fails every allocation.
struct LastRequest : std::pmr::memory_resource {
  std::size_t bytes = 0;
  void* do_allocate(std::size_t wanted, std::size_t) override {
    bytes = wanted;
    throw std::bad_alloc();
  }
  void do_deallocate(void*, std::size_t, std::size_t) override {}
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

TEST(Edges, RejectsOverflowingSizes) {
  LastRequest request;
  base::Memory memory(&request, 0);
  for (const std::size_t count :
       {all_ones, all_ones - 1, all_ones / sizeof(Pair) + 1, all_ones / 9 * 8 / sizeof(Pair) + 9,
        std::size_t{1} << 61, (std::size_t{1} << 61) + 3, std::size_t{1} << 63}) {
    base::Buffer<Pair> pairs(memory);
    for (const bool exact : {false, true}) {
      try {
        pairs.ensure(count, exact);
        ADD_FAILURE() << count << " pairs were returned";
      } catch (const base::AllocationFailed& e) {
        EXPECT_GE(e.bytes / sizeof(Pair), std::min(count, all_ones / sizeof(Pair))) << count;
      }
    }
    EXPECT_THROW(pairs.grow(count, 0), base::AllocationFailed);
    EXPECT_EQ(pairs.capacity(), 0u);
  }
  EXPECT_EQ(memory.held(), 0u);
}

TEST(Edges, ReportsACapExceededByTheSum) {
  tests::CountingResource resource;
  base::Memory memory(&resource, 100);
  memory.set_cap(1000);
  try {
    memory.take(all_ones - 50, 8);
    ADD_FAILURE() << "was returned";
  } catch (const base::CapExceeded& e) {
    EXPECT_EQ(e.bytes_needed, all_ones);
  }
}

// The arrays of a strip of maximum length: 32-bit sizes would wrap around.
TEST(Edges, StripOfMaximumLength) {
  LastRequest request;
  base::Memory memory(&request, 0);
  StripStorage space(memory);
  for (const std::uint64_t count : {max_box_count, max_box_count - 1, std::uint64_t{1} << 31}) {
    Strip strip;
    strip.count = static_cast<std::uint32_t>(count);
    EXPECT_THROW(space.assign_storage(strip, false), base::AllocationFailed);
    EXPECT_GE(request.bytes, 6 * count * sizeof(std::int16_t));
  }
}

// Pairs beyond the capacity are only counted.
TEST(Edges, SinkKeepsCounting) {
  BufferSink sink(nullptr, 0, nullptr, 0);
  const std::size_t blocks[] = {(std::size_t{1} << 24) + 1, (std::size_t{1} << 31) + 1,
                                std::size_t{1} << 32, (std::size_t{1} << 63) - 1};
  std::uint64_t sum = 0;
  for (const std::size_t block : blocks) {
    sink.take(nullptr, block);
    sum += block;
    EXPECT_EQ(sink.found(), sum);
    EXPECT_EQ(sink.written(), 0u);
  }
  EXPECT_GT(sum, std::uint64_t{1} << 63);
}

}  // namespace
}  // namespace throng::grid
