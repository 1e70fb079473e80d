// Splitting a region at gaps, without MPI.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "mpi/gap_partition.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::mpi {
namespace {

constexpr Key first_key = std::numeric_limits<Key>::min(),
              last_key = std::numeric_limits<Key>::max();
constexpr Bounds everywhere = {{first_key, first_key, first_key}, {last_key, last_key, last_key}};

std::vector<KeyBox> key_boxes_of(const std::vector<Box>& boxes, float margin = 0) {
  std::vector<KeyBox> key_boxes;
  for (const Box& box : boxes) key_boxes.push_back(key_box_of(box, margin));
  return key_boxes;
}

// Uses every box as the sample, so that small scenes are split, too.
GapPartition cut(const Bounds& region, const std::vector<KeyBox>& key_boxes) {
  std::vector<KeyBox> sample;
  for (const KeyBox& key_box : key_boxes) {
    if (!key_box.empty()) sample.push_back(key_box);
  }
  return GapPartition(region, std::move(sample));
}

// Each pair whose reference corner lies in the region must be reported by exactly one part, by the
// rule of RegionSearch.
void expect_reported_once(const std::vector<Box>& boxes, float margin, const Bounds& region,
                          const GapPartition& parts, const std::string& name) {
  const std::vector<KeyBox> key_boxes = key_boxes_of(boxes, margin);
  std::vector<std::vector<std::size_t>> reached(boxes.size());
  std::vector<bool> here(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    here[i] = region.meets(key_boxes[i]);
    if (!here[i]) continue;
    parts.visit(key_boxes[i], [&](std::size_t part) { reached[i].push_back(part); });
    std::uint32_t located = 0;
    parts.locate(&key_boxes[i], 1, &located);
    ASSERT_EQ(located, reached[i].size() == 1 ? reached[i][0] : GapPartition::several) << name;
    ASSERT_FALSE(reached[i].empty()) << name << ", box " << i;
  }
  for (const Pair pair : tests::reference_pairs(boxes, margin).pairs) {
    const KeyBox &a = key_boxes[pair.first], &b = key_boxes[pair.second];
    bool is_owned = true;
    for (int k = 0; k < 3; ++k) {
      const Key corner = std::max(a.lower[k], b.lower[k]);
      is_owned = is_owned && corner >= region.lower[k] && corner < region.upper[k];
    }
    int reported = 0;
    for (std::size_t part = 0; part < parts.count(); ++part) {
      const auto has = [&](std::uint32_t box) {
        return std::count(reached[box].begin(), reached[box].end(), part) != 0;
      };
      if (!has(pair.first) || !has(pair.second)) continue;
      bool above = true;
      for (int k = 0; k < 3; ++k) {
        const Key lower = parts.bounds(part).lower[k];
        above = above && (a.lower[k] >= lower || b.lower[k] >= lower);
      }
      reported += above;
    }
    ASSERT_EQ(reported, is_owned ? 1 : 0) << name << ": " << pair.first << ", " << pair.second;
  }
}

std::vector<Box> clusters(std::size_t count, std::size_t boxes, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Box> all;
  std::vector<Vec3> origins;
  const auto up_to = [&](float most) {
    return most * static_cast<float>(random() % 65536) / 65536.0f;
  };
  // Each clump has its own lattice cell, which leaves gaps.
  for (std::size_t c = 0; c < count; ++c) {
    const auto at = [&](std::size_t k) { return static_cast<float>(k % 3) * 200 + up_to(60); };
    origins.push_back({at(c), at(c / 3), at(c / 9)});
  }
  for (std::size_t i = 0; i < boxes; ++i) {
    const Vec3& o = origins[i % count];
    const Vec3 l = {o.x + up_to(10), o.y + up_to(10), o.z + up_to(10)};
    all.push_back({l, {l.x + 1, l.y + 1, l.z + 1}});
  }
  return all;
}

TEST(GapPartition, EachClusterIsAPart) {
  for (const std::size_t count : {2u, 5u, 20u}) {
    const std::vector<Box> boxes = clusters(count, 4000, 1);
    const std::vector<KeyBox> key_boxes = key_boxes_of(boxes);
    std::vector<KeyBox> sample;
    for (const std::size_t i : GapPartition::sample(boxes.size())) sample.push_back(key_boxes[i]);
    const GapPartition parts(everywhere, sample);
    ASSERT_EQ(parts.count(), count);
    std::vector<std::size_t> part_of(count, count);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      int reached = 0;
      parts.visit(key_boxes[i], [&](std::size_t part) {
        ++reached;
        if (i < count) part_of[i] = part;
        ASSERT_EQ(part_of[i % count], part) << "clump " << i % count << " is cut";
      });
      ASSERT_EQ(reached, 1);
    }
    std::sort(part_of.begin(), part_of.end());
    EXPECT_EQ(std::unique(part_of.begin(), part_of.end()), part_of.end());
  }
}

TEST(GapPartition, UniformBoxesAreOnePart) {
  for (const std::size_t count : {0u, 1u, 511u, 512u, 3000u, 40000u}) {
    const std::vector<Box> boxes = tests::uniform_boxes(count, 5);
    std::vector<KeyBox> sample;
    for (const std::size_t i : GapPartition::sample(boxes.size())) {
      ASSERT_LT(i, boxes.size());
      sample.push_back(key_box_of(boxes[i], 0));
    }
    EXPECT_EQ(GapPartition(everywhere, sample).count(), 1u) << count;
  }
}

TEST(GapPartition, EachPairIsReportedByOnePart) {
  for (const tests::HardScene& scene : tests::hard_scenes(300)) {
    for (const float margin : {0.0f, 0.1f}) {
      const GapPartition parts = cut(everywhere, key_boxes_of(scene.boxes, margin));
      ASSERT_NO_FATAL_FAILURE(
          expect_reported_once(scene.boxes, margin, everywhere, parts, scene.name));
    }
  }
}

// Boxes that cross gaps and are not in the sample, and regions with ghosts beyond their bounds.
TEST(GapPartition, EachPairIsReportedOnceAcrossGaps) {
  for (std::uint32_t seed = 1; seed < 6; ++seed) {
    std::vector<Box> boxes = clusters(7, 800, seed);
    for (const float at : {200.0f, 300.0f}) {
      for (int axis = 0; axis < 3; ++axis) {
        Bounds region = everywhere;
        (seed % 2 ? region.lower : region.upper)[axis] = key_of(at + 5);
        const GapPartition parts = cut(region, key_boxes_of(boxes));
        ASSERT_GT(parts.count(), 3u);
        std::vector<Box> more = boxes;
        std::mt19937 random(seed);
        for (int i = 0; i < 60; ++i) {
          Box& box = more[random() % more.size()];
          (&box.upper.x)[random() % 3] += static_cast<float>(random() % 500);
        }
        more[3] = {{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}};
        ASSERT_NO_FATAL_FAILURE(expect_reported_once(more, 0, region, parts, "crossed"));
      }
    }
  }
}

}  // namespace
}  // namespace throng::mpi
