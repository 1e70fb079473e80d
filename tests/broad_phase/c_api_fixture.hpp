// Makes the same calls through the C API and the C++ API, and compares the results.
#pragma once

#include <throng/throng.h>

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <throng/broad_phase.hpp>
#include <throng/broad_phase_query.hpp>

#include "broad_phase/snapshot.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {

inline std::vector<Row> rows(const throng_live_pair* pairs, size_t count) {
  std::vector<Row> list;
  for (size_t i = 0; i < count; ++i)
    list.emplace_back(pairs[i].first, pairs[i].second, pairs[i].slot);
  return list;
}
inline throng_boxes view(const std::vector<Box>& boxes) {
  return throng_boxes_packed(reinterpret_cast<const throng_box*>(boxes.data()), boxes.size());
}

inline void expect_same(const throng_pair* got, size_t count, const Pairs& want) {
  ASSERT_EQ(count, want.size());
  for (size_t i = 0; i < count; ++i) {
    EXPECT_EQ(got[i].first, want[i].first);
    EXPECT_EQ(got[i].second, want[i].second);
  }
}
inline void expect_same(const throng_sweep_hit* got, size_t count, const SweepHitList& want) {
  ASSERT_EQ(count, want.size());
  for (size_t i = 0; i < count; ++i) {
    EXPECT_EQ(got[i].sweep, want[i].sweep);
    EXPECT_EQ(got[i].object, want[i].object);
    EXPECT_EQ(got[i].time, want[i].time);
  }
}

class CBroadPhase : public testing::Test {
 protected:
  void TearDown() override { throng_broad_phase_destroy(c_); }

  std::string message() const { return throng_broad_phase_result(c_)->message; }
  std::vector<Row> event_rows(const throng_live_pair* (*get)(const throng_broad_phase*, size_t*)) {
    size_t count = 0;
    const throng_live_pair* const pairs = get(c_, &count);
    return rows(pairs, count);
  }
  void update_both_and_compare() {
    ASSERT_EQ(throng_broad_phase_update(c_), THRONG_OK) << message();
    ASSERT_TRUE(cpp_.update().ok());
    EXPECT_EQ(event_rows(throng_broad_phase_begun), rows(cpp_.begun()));
    EXPECT_EQ(event_rows(throng_broad_phase_ended), rows(cpp_.ended()));
    size_t count = 0;
    const throng_live_pair* const pairs = throng_broad_phase_pairs(c_, &count);
    EXPECT_EQ(rows(pairs, count), rows(cpp_.pairs()));
    EXPECT_EQ(throng_broad_phase_result(c_)->found, count);
    EXPECT_EQ(throng_broad_phase_pair_count(c_), count);
    EXPECT_EQ(throng_broad_phase_object_count(c_), cpp_.object_count());
    EXPECT_EQ(throng_broad_phase_id_limit(c_), cpp_.id_limit());
    EXPECT_EQ(throng_broad_phase_slot_limit(c_), cpp_.slot_limit());
  }

  throng_broad_phase* c_ = throng_broad_phase_create(nullptr);
  BroadPhase cpp_;
  std::vector<Box> boxes_ = snapped_boxes(300, 10, 0.25f, 7);
};

}  // namespace throng::tests
