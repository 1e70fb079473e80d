// Boxes in every memory layout, each changed in one coordinate.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "broad_phase/snapshot.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// Two that touch, one apart.
const BoxList three = {cube(0, 0, 0, 1), cube(1, 0, 0, 1), cube(5, 0, 0, 1)};

float part(const Box& box, int k) {
  float c[6];
  std::memcpy(c, &box, sizeof c);
  return c[k];
}
void set(Box& box, int k, float value) {
  float c[6];
  std::memcpy(c, &box, sizeof c);
  c[k] = value;
  std::memcpy(&box, c, sizeof c);
}

// The layouts: contiguous, strided, and one array per coordinate.
class Layouts {
 public:
  static constexpr std::size_t count = 3;
  explicit Layouts(const BoxList& boxes) : packed_(boxes) {
    for (const Box& box : boxes) {
      apart_.push_back({box, {0, 0}});
      for (int k = 0; k < 6; ++k) coordinate_[k].push_back(part(box, k));
    }
  }
  Boxes view(std::size_t layout) const {
    if (layout == 0) return packed_;
    if (layout == 1) return {&apart_[0].box, apart_.size(), sizeof(Apart)};
    const auto& c = coordinate_;
    return Boxes::arrays(c[0].data(), c[1].data(), c[2].data(), c[3].data(), c[4].data(),
                         c[5].data(), packed_.size());
  }

 private:
  struct Apart {
    Box box;
    float between[2];
  };
  BoxList packed_;
  std::vector<Apart> apart_;
  std::vector<float> coordinate_[6];
};

TEST(BroadPhaseMoves, EveryCoordinateIsCompared) {
  const ObjectId ids[] = {0, 1, 2};
  for (int k = 0; k < 6; ++k) {
    BoxList moved = three, bad = three, flat = three, inverted = three;
    set(moved[2], k, part(moved[2], k) + (k < 3 ? -0.5f : 0.5f));
    set(bad[2], k, std::nanf(""));
    set(flat[1], k, part(flat[1], (k + 3) % 6));
    set(inverted[1], k, part(inverted[1], (k + 3) % 6) + (k < 3 ? 0.5f : -0.5f));
    for (std::size_t layout = 0; layout < Layouts::count; ++layout) {
      for (const bool listed : {false, true}) {
        BroadPhase b;
        ASSERT_TRUE(b.add(three, nullptr).ok());
        ASSERT_TRUE(b.update().ok());
        const auto move = [&](const BoxList& boxes) {
          const Layouts layouts(boxes);
          const Boxes view = layouts.view(layout);
          return listed ? b.move(ids, view) : b.move_all(view);
        };
        const Snapshot before(b);
        const Result r = move(bad);
        EXPECT_EQ(r.status, Status::nan_box) << k;
        EXPECT_EQ(r.first_invalid, 2u);
        EXPECT_EQ(Snapshot(b), before);
        EXPECT_TRUE(move(moved).ok());
        EXPECT_STRNE(b.update().plan.reason, "nothing changed") << k << " " << layout;
        EXPECT_EQ(part(b.box(2), k), part(moved[2], k));
        EXPECT_TRUE(move(inverted).ok());
        EXPECT_EQ(b.update().inactive, 1u) << k << " " << layout;
        EXPECT_TRUE(move(flat).ok());
        EXPECT_EQ(b.update().inactive, 0u) << k << " " << layout;
      }
    }
  }
}

}  // namespace
}  // namespace throng::tests
