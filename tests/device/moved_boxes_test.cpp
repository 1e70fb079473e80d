// Whether any object has a new box: the per-thread comparisons, in sequence.
#include <gtest/gtest.h>

#include <vector>

#include "device/object_stages.hpp"
#include "support/hard_boxes.hpp"

namespace throng::device {
namespace {

struct Objects {
  explicit Objects(std::size_t n)
      : before(tests::uniform_boxes(n, 1)), state(n, alive_bit), memory(n * sizeof(Box) + 32) {}

  // `off`: byte offset of the new boxes from a multiple of 16.
  bool differ(const tests::BoxList& now, std::size_t off) {
    char* to = memory.data();
    while (reinterpret_cast<std::uintptr_t>(to) % 16 != 0) ++to;
    to += off;
    std::memcpy(to, now.data(), now.size() * sizeof(Box));
    ObjectView view{};
    view.boxes = before.data();
    view.state = state.data();
    view.limit = static_cast<std::uint32_t>(before.size());
    std::uint32_t moved = 0;
    const Boxes given(reinterpret_cast<const Box*>(to), now.size());
    const FindMoved look{view, make_set(given), &moved};
    EXPECT_EQ(look.compares_words, off == 0);
    for (std::uint64_t i = 0; i < look.count(); ++i) look(i);
    return moved != 0;
  }

  tests::BoxList before;
  std::vector<std::uint8_t> state;
  std::vector<char> memory;
};

TEST(FindMoved, EveryCoordinateOfEveryBox) {
  for (const std::size_t n : {1, 2, 3, 4, 5, 8, 11})
    for (const std::size_t off : {0, 8, 4}) {
      Objects objects(n);
      EXPECT_FALSE(objects.differ(objects.before, off));
      for (std::size_t k = 0; k < 6 * n; ++k) {
        tests::BoxList now = objects.before;
        float* coordinate = reinterpret_cast<float*>(&now[k / 6]) + k % 6;
        *coordinate += 0.5f;
        EXPECT_TRUE(objects.differ(now, off)) << n << ' ' << off << ' ' << k;
        // An object that is not alive is ignored, even if it shares words with its neighbours.
        objects.state[k / 6] = 0;
        EXPECT_FALSE(objects.differ(now, off)) << n << ' ' << off << ' ' << k;
        objects.state[k / 6] = alive_bit;
      }
    }
}

}  // namespace
}  // namespace throng::device
