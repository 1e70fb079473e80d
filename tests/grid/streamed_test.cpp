// Records written to their columns through buffers give the same pairs as direct writes.
#include <gtest/gtest.h>

#include <string>

#include <throng/throng.hpp>

#include "grid/searched_grid.hpp"
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::grid {
namespace {

using tests::BoxList;
using How = SearchedGrid::How;

How streamed(Isa isa, unsigned tasks) { return {tasks, 1, isa, 0}; }

TEST(Streamed, HardScenes) {
  for (const tests::HardScene& scene : tests::hard_scenes(tests::sanitized ? 1000 : 3000)) {
    const BoxList boxes = scene.boxes;
    const SearchedGrid direct(boxes, How{});
    EXPECT_FALSE(direct.buffered());
    for (const Isa isa : tests::supported_isas()) {
      for (const unsigned tasks : {1u, 3u}) {
        SCOPED_TRACE(scene.name + std::string(", ") + to_string(isa) + ", " +
                     std::to_string(tasks));
        const SearchedGrid grid(boxes, streamed(isa, tasks));
        EXPECT_EQ(grid.buffered(), isa != Isa::scalar);
        EXPECT_EQ(grid.inactive(), direct.inactive());
        EXPECT_TRUE(grid.sorted_pairs() == direct.sorted_pairs());
      }
    }
  }
}

TEST(Streamed, TwoSets) {
  const BoxList a = tests::uniform_boxes(3000, 1), b = tests::uniform_boxes(2000, 2);
  const SearchedGrid direct(a, b, How{});
  ASSERT_GT(direct.sorted_pairs().size(), 500u);
  for (const unsigned tasks : {1u, 2u}) {
    const SearchedGrid grid(a, b, streamed(Isa::automatic, tasks));
    EXPECT_TRUE(grid.sorted_pairs() == direct.sorted_pairs());
  }
}

// With more columns buffers become shorter, then disappear.
TEST(Streamed, ManyColumns) {
  if (find_kernels(Isa::automatic)->isa == Isa::scalar) GTEST_SKIP() << "no SIMD available";
  constexpr float finer = 0.02f;
  struct Case {
    int boxes;
    std::uint32_t more, at_most;  // columns
    bool buffered;
  };
  for (const Case& c : {Case{250'000, 4096, 8192, true}, Case{450'000, 8192, 16384, true},
                        Case{1'200'000, 16384, 32768, false}}) {
    if (tests::thread_sanitized && c.boxes > 250'000) continue;
    const BoxList boxes = tests::uniform_boxes(c.boxes, 3);
    const SearchedGrid grid(boxes, How{2, finer, Isa::automatic, 0});
    EXPECT_GT(grid.plan().column_count(), c.more);
    EXPECT_LE(grid.plan().column_count(), c.at_most);
    EXPECT_EQ(grid.buffered(), c.buffered);
    EXPECT_TRUE(grid.sorted_pairs() == SearchedGrid(boxes, How{}).sorted_pairs());
  }
}

TEST(Streamed, StartsAtThreshold) {
  if (tests::thread_sanitized) GTEST_SKIP() << tests::one_thread;
  EXPECT_FALSE(SearchedGrid(tests::uniform_boxes(100'000, 4), How{}).buffered());
  if (find_kernels(Isa::automatic)->isa == Isa::scalar) GTEST_SKIP() << "no SIMD available";
  constexpr int boxes = static_cast<int>(base::cost.stream_bytes / sizeof(Record));
  EXPECT_TRUE(SearchedGrid(tests::uniform_boxes(boxes, 4), How{}).buffered());
}

}  // namespace
}  // namespace throng::grid
