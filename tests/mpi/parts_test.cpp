// Splitting a region at gaps, without MPI.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "mpi/parts.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::mpi {
namespace {

constexpr Key first_key = std::numeric_limits<Key>::min(),
              last_key = std::numeric_limits<Key>::max();
constexpr Bounds everywhere = {{first_key, first_key, first_key}, {last_key, last_key, last_key}};

std::vector<Reach> reaches_of(const std::vector<Box>& boxes, float margin = 0) {
  std::vector<Reach> reaches;
  for (const Box& box : boxes) reaches.push_back(reach_of(box, margin));
  return reaches;
}

// Uses every box as the sample, so that small scenes are split, too.
Parts cut(const Bounds& region, const std::vector<Reach>& reaches) {
  std::vector<Reach> sample;
  for (const Reach& reach : reaches) {
    if (!reach.empty()) sample.push_back(reach);
  }
  return Parts(region, std::move(sample));
}

// Each pair whose reference corner lies in the region must be reported by exactly one part, by the
// rule of Share.
void expect_told_once(const std::vector<Box>& boxes, float margin, const Bounds& region,
                      const Parts& parts, const std::string& name) {
  const std::vector<Reach> reaches = reaches_of(boxes, margin);
  std::vector<std::vector<std::size_t>> reached(boxes.size());
  std::vector<bool> here(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    here[i] = region.meets(reaches[i]);
    if (!here[i]) continue;
    parts.visit(reaches[i], [&](std::size_t part) { reached[i].push_back(part); });
    std::uint32_t located = 0;
    parts.locate(&reaches[i], 1, &located);
    ASSERT_EQ(located, reached[i].size() == 1 ? reached[i][0] : Parts::several) << name;
    ASSERT_FALSE(reached[i].empty()) << name << ", box " << i;
  }
  for (const Pair pair : tests::reference_pairs(boxes, margin).pairs) {
    const Reach &a = reaches[pair.first], &b = reaches[pair.second];
    bool is_home = true;
    for (int k = 0; k < 3; ++k) {
      const Key corner = std::max(a.lower[k], b.lower[k]);
      is_home = is_home && corner >= region.lower[k] && corner < region.upper[k];
    }
    int told = 0;
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
      told += above;
    }
    ASSERT_EQ(told, is_home ? 1 : 0) << name << ": " << pair.first << ", " << pair.second;
  }
}

std::vector<Box> clumps(std::size_t count, std::size_t boxes, std::uint32_t seed) {
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

TEST(Parts, ClumpsAreToldApart) {
  for (const std::size_t count : {2u, 5u, 20u}) {
    const std::vector<Box> boxes = clumps(count, 4000, 1);
    const std::vector<Reach> reaches = reaches_of(boxes);
    std::vector<Reach> sample;
    for (const std::size_t i : Parts::sample(boxes.size())) sample.push_back(reaches[i]);
    const Parts parts(everywhere, sample);
    ASSERT_EQ(parts.count(), count);
    std::vector<std::size_t> part_of(count, count);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      int reached = 0;
      parts.visit(reaches[i], [&](std::size_t part) {
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

TEST(Parts, WhatIsSpreadEvenlyIsOne) {
  for (const std::size_t count : {0u, 1u, 511u, 512u, 3000u, 40000u}) {
    const std::vector<Box> boxes = tests::uniform_boxes(count, 5);
    std::vector<Reach> sample;
    for (const std::size_t i : Parts::sample(boxes.size())) {
      ASSERT_LT(i, boxes.size());
      sample.push_back(reach_of(boxes[i], 0));
    }
    EXPECT_EQ(Parts(everywhere, sample).count(), 1u) << count;
  }
}

TEST(Parts, EachPairIsToldByOneOfThem) {
  for (const tests::HardScene& scene : tests::hard_scenes(300)) {
    for (const float margin : {0.0f, 0.1f}) {
      const Parts parts = cut(everywhere, reaches_of(scene.boxes, margin));
      ASSERT_NO_FATAL_FAILURE(expect_told_once(scene.boxes, margin, everywhere, parts, scene.name));
    }
  }
}

// Boxes that cross gaps and are not in the sample, and regions with ghosts beyond their bounds.
TEST(Parts, EachPairIsToldOnceWhateverCrosses) {
  for (std::uint32_t seed = 1; seed < 6; ++seed) {
    std::vector<Box> boxes = clumps(7, 800, seed);
    for (const float at : {200.0f, 300.0f}) {
      for (int axis = 0; axis < 3; ++axis) {
        Bounds region = everywhere;
        (seed % 2 ? region.lower : region.upper)[axis] = key_of(at + 5);
        const Parts parts = cut(region, reaches_of(boxes));
        ASSERT_GT(parts.count(), 3u);
        std::vector<Box> more = boxes;
        std::mt19937 random(seed);
        for (int i = 0; i < 60; ++i) {
          Box& box = more[random() % more.size()];
          (&box.upper.x)[random() % 3] += static_cast<float>(random() % 500);
        }
        more[3] = {{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}};
        ASSERT_NO_FATAL_FAILURE(expect_told_once(more, 0, region, parts, "crossed"));
      }
    }
  }
}

}  // namespace
}  // namespace throng::mpi
