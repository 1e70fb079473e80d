// Scaled plans respect the limits of every plan, for any boxes.
#include <gtest/gtest.h>

#include "grid/plan/planner.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::grid {
namespace {

GridPlan plan_of(const tests::BoxList& boxes, std::uint64_t count, float cell_scale) {
  std::vector<Box> sample;
  for (const Box& b : boxes) {
    const bool active = b.lower.x <= b.upper.x && b.lower.y <= b.upper.y && b.lower.z <= b.upper.z;
    if (active && sample.size() < max_sample) sample.push_back(b);
  }
  const Stats stats =
      measure(sample.data(), static_cast<std::uint32_t>(sample.size()), count, count);
  return plan(stats, {0.5, 0.2, 4, 0.08}, Algorithm::grid, cell_scale);
}

TEST(Planner, ScaledPlansAreWithinLimits) {
  for (const auto& scene : tests::hard_scenes(600)) {
    for (const std::uint64_t count :
         {std::uint64_t{2}, std::uint64_t{600}, std::uint64_t{100000}, max_box_count}) {
      SCOPED_TRACE(scene.name + " " + std::to_string(count));
      const GridPlan own = plan_of(scene.boxes, count, 1);
      for (const float scale : {1 / 64.0f, 0.25f, 0.9f, 1.1f, 4.0f, 64.0f}) {
        const GridPlan p = plan_of(scene.boxes, count, scale);
        EXPECT_EQ(p.sweep_axis, own.sweep_axis);
        std::uint64_t columns = 1;
        for (std::uint32_t k = 0; k < 3; ++k) {
          columns *= p.map.columns[k];
          EXPECT_GE(p.map.columns[k], 1u);
          EXPECT_LE(p.map.columns[k], base::max_columns_per_axis);
          if (k == p.sweep_axis) continue;
          if (scale < 1) {
            EXPECT_GE(p.map.columns[k], own.map.columns[k]) << scale;
          } else {
            EXPECT_LE(p.map.columns[k], own.map.columns[k]) << scale;
          }
        }
        EXPECT_LE(columns,
                  std::max<std::uint64_t>(1, std::min(count / 48, std::uint64_t{1} << 17)));
        EXPECT_LE(p.replicas, std::max(own.replicas, max_scaled_replicas)) << scale;
        EXPECT_GT(p.expected_ns, 0);
      }
    }
  }
}

// Without boxes the statistics are empty and finite.
TEST(Planner, NothingMeasured) {
  const Stats s = measure(nullptr, 0, 5, 7);
  EXPECT_EQ(s.query_count, 5u);
  EXPECT_EQ(s.target_count, 7u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(s.lower[k], 0);
    EXPECT_EQ(s.upper[k], 0);
    EXPECT_EQ(s.extent[k], 0);
  }
  EXPECT_EQ(s.density_ratio, 1);
}

// Infinite ends count as the largest floats: the other boxes are planned as if these were absent.
TEST(Planner, InfiniteBoxesDoNotAffectThePlan) {
  const tests::BoxList plain = tests::uniform_boxes(500, 3);
  tests::BoxList boxes = plain;
  for (std::size_t i = 0; i < 12; ++i) {
    float* corner = &boxes[40 * i].lower.x;
    if (i % 4 != 3) corner[i % 3] = -tests::infinity;
    if (i % 4 != 2) corner[3 + i % 3] = tests::infinity;
  }
  const GridPlan own = plan_of(plain, 1000000, 1), p = plan_of(boxes, 1000000, 1);
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(std::isfinite(p.map.origin[k]));
    EXPECT_TRUE(std::isfinite(p.map.scale[k]));
    EXPECT_GT(p.map.scale[k], 0);
  }
  EXPECT_GT(p.map.column_count(), own.map.column_count() / 16);
}

// Most boxes in layers share a slab along that axis, for any number of slabs; no plan sweeps along
// it, or divides it finely. Evenly spread boxes are not clustered.
TEST(Planner, DetectsLayers) {
  EXPECT_FALSE(measure(tests::uniform_boxes(512, 3).data(), 512, 512, 512).clustered);
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    tests::BoxList boxes = tests::uniform_boxes(512, 3);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      float* const corner = &boxes[i].lower.x;
      corner[axis] = i % 8 == 0 ? corner[axis] : 5;
      corner[3 + axis] = corner[axis] + 0.01f;
    }
    const Stats s = measure(boxes.data(), 512, 100000, 100000);
    EXPECT_TRUE(s.clustered);
    for (std::uint32_t cells : {1u, 2u, 5u, 8u, 100u, 128u, 1000u, 1u << 20}) {
      SCOPED_TRACE(cells);
      for (std::uint32_t k = 0; k < 3; ++k) {
        const double effective_slabs = s.effective_slabs_at(k, cells);
        EXPECT_GE(effective_slabs, 1);
        EXPECT_LE(effective_slabs, cells * 1.001);
        if (k != axis) {
          EXPECT_GE(effective_slabs, (cells <= 128 ? 0.8 : 0.5) * cells);
        } else {
          EXPECT_LE(effective_slabs, 2);
        }
      }
    }
    const GridPlan p = plan_of(boxes, 100000, 1);
    EXPECT_NE(p.sweep_axis, axis);
    EXPECT_LE(p.map.columns[axis], 16u);
  }
}

// Layers at equal distances are spread evenly over the cells of a sample, yet all boxes of one
// layer begin within each other. Boxes of very different sizes are no layers.
TEST(Planner, DetectsEvenLayers) {
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    for (const float thickness : {0.0f, 0.01f}) {
      tests::BoxList boxes = tests::uniform_boxes(512, 3);
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        float* const corner = &boxes[i].lower.x;
        corner[axis] = static_cast<float>(i * 5 % 14);
        corner[3 + axis] = corner[axis] + thickness;
      }
      const Stats s = measure(boxes.data(), 512, 8000, 8000);
      EXPECT_FALSE(s.clustered);
      for (std::uint32_t k = 0; k < 3; ++k) {
        if (k != axis) {
          EXPECT_EQ(s.layer_overlap[k], 0) << k;
        } else {
          EXPECT_NEAR(s.layer_overlap[k], 1 / 14.0, 0.02);
        }
      }
      EXPECT_NE(plan_of(boxes, 8000, 1).sweep_axis, axis);
    }
  }
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    tests::Random r(seed);
    tests::BoxList boxes;
    for (int i = 0; i < 512; ++i)
      boxes.push_back(tests::cube(r.point(0, 100), r.one_in(30) ? 30 : 0.1f));
    const Stats s = measure(boxes.data(), 512, 100000, 100000);
    EXPECT_FALSE(s.clustered);
    for (const double within : s.layer_overlap) EXPECT_EQ(within, 0) << seed;
  }
}

// Boxes along a diagonal are clustered across one axis only: boxes that share a slab along either
// of the other axes share both.
TEST(Planner, DetectsDiagonals) {
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    tests::BoxList boxes = tests::uniform_boxes(512, 3);
    for (Box& box : boxes) {
      float* const corner = &box.lower.x;
      const std::uint32_t y = (axis + 1) % 3, z = (axis + 2) % 3;
      corner[z] = corner[y];
      corner[3 + z] = corner[3 + y];
    }
    const Stats s = measure(boxes.data(), 512, 100000, 100000);
    EXPECT_TRUE(s.clustered);
    EXPECT_GE(s.joint_correlation, 4);
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (k == axis) {
        EXPECT_GE(s.axis_correlation[k], 4);
      } else {
        EXPECT_LE(s.axis_correlation[k], 2);
      }
    }
  }
}

// Boxes of a thousandth of their coordinates, over `count` decades along each axis.
tests::BoxList decades(float count, bool both_sides, float centre) {
  tests::Random r(5);
  tests::BoxList boxes;
  for (int i = 0; i < 512; ++i) {
    float c[6];
    for (int k = 0; k < 3; ++k) {
      const float at = std::pow(10.0f, r.in(-count / 2, count / 2));
      const bool below = both_sides && r.one_in(2);
      c[k] = centre + (below ? -1.001f : 0.999f) * at;
      c[k + 3] = centre + (below ? -0.999f : 1.001f) * at;
    }
    boxes.push_back({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}});
  }
  return boxes;
}

// Positions by bits spread such boxes about evenly; other boxes keep their coordinates.
TEST(Planner, DetectsManyDecades) {
  for (const float count : {8.0f, 12.0f, 60.0f}) {
    for (const bool both : {false, true}) {
      SCOPED_TRACE(count);
      const Stats s = measure(decades(count, both, 0).data(), 512, 100000, 100000);
      for (int k = 0; k < 3; ++k) {
        EXPECT_TRUE(s.by_bits[k]);
        EXPECT_EQ(s.centre[k], 0);
      }
      const GridPlan p = plan_of(decades(count, both, 0), 100000, 1);
      EXPECT_FALSE(p.map.is_identity);
      EXPECT_LT(p.expected_ns, 4 * plan_of(tests::uniform_boxes(512, 3), 100000, 1).expected_ns);
    }
  }
  // Around a centre other than 0, where floats are at least this far apart.
  for (const bool both : {false, true}) {
    const Stats s = measure(decades(12, both, 5).data(), 512, 100000, 100000);
    for (int k = 0; k < 3; ++k) {
      EXPECT_TRUE(s.by_bits[k]);
      EXPECT_NEAR(s.centre[k], 5, 0.1);
    }
  }
  for (const auto& boxes :
       {tests::uniform_boxes(512, 3), tests::clusters_and_outliers(512, 3), tests::rods(512, 3),
        tests::one_cell(512, 3), tests::huge_among_small(512, 3), decades(1, false, 0)}) {
    EXPECT_TRUE(plan_of(boxes, 100000, 1).map.is_identity);
  }
}

// The same boxes at any scale, per axis, get the same plan and the same resolution.
TEST(Planner, ScaledScenesHaveTheSamePlan) {
  const tests::BoxList boxes = tests::uniform_boxes(512, 3);
  const GridPlan own = plan_of(boxes, 100000, 1);
  EXPECT_TRUE(own.map.is_identity);
  const float side = tests::side_of(1024);
  for (const int exponent : {-140, -130, -126, -110, -60, 60, 110, 124}) {
    for (const std::uint32_t axes : {1u, 2u, 7u}) {
      SCOPED_TRACE(std::to_string(exponent) + " of " + std::to_string(axes));
      tests::BoxList scaled = boxes;
      for (Box& box : scaled) {
        for (int k = 0; k < 6; ++k) {
          if (axes >> (k % 3) & 1) (&box.lower.x)[k] = std::ldexp((&box.lower.x)[k], exponent);
        }
      }
      const GridPlan p = plan_of(scaled, 100000, 1);
      EXPECT_EQ(p.sweep_axis, own.sweep_axis);
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(p.map.columns[k], own.map.columns[k]);
        if (!(axes >> k & 1)) continue;
        const float first = std::ldexp(side / 4, exponent), last = std::ldexp(side / 2, exponent);
        EXPECT_NEAR(quantize(p.map, k, last) - quantize(p.map, k, first),
                    quantize(own.map, k, side / 2) - quantize(own.map, k, side / 4),
                    (exponent < -130 ? 0.1f : 0.001f) * p.map.max[k]);
      }
    }
  }
}

// The plan is the cheapest: a scaled plan has a higher expected cost, or the same if nothing
// changed.
TEST(Planner, ScaledPlansCostMore) {
  const tests::BoxList boxes = tests::uniform_boxes(512, 3);
  const GridPlan own = plan_of(boxes, 1000000, 1);
  for (const float scale : {1 / 64.0f, 0.25f, 4.0f, 64.0f}) {
    const GridPlan p = plan_of(boxes, 1000000, scale);
    EXPECT_NE(p.map.column_count(), own.map.column_count());
    EXPECT_GT(p.expected_ns, own.expected_ns) << scale;
  }
}

}  // namespace
}  // namespace throng::grid
