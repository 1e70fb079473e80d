// The layout of every struct of the C API on 64-bit systems. A program keeps working with a newer
// library if these lines are never changed, except that throng_options and throng_result may gain
// fields: these begin at the struct's former size, not in its padding.
#include <throng/throng.h>

#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <string>

namespace throng::tests {
namespace {

#if defined(__LP64__) || defined(_WIN64)
template <class T>
constexpr bool layout(std::size_t size, std::size_t alignment) {
  return sizeof(T) == size && alignof(T) == alignment;
}
static_assert(layout<throng_box>(24, 4) && offsetof(throng_box, upper) == 12);
static_assert(layout<throng_pair>(8, 4) && offsetof(throng_pair, second) == 4);
static_assert(layout<throng_strided>(16, 8) && offsetof(throng_strided, stride_bytes) == 8);
static_assert(layout<throng_boxes>(144, 8) && offsetof(throng_boxes, corner) == 8 &&
              offsetof(throng_boxes, stride_bytes) == 56 && offsetof(throng_boxes, group) == 64 &&
              offsetof(throng_boxes, mask) == 80 && offsetof(throng_boxes, owner) == 96 &&
              offsetof(throng_boxes, world) == 112 && offsetof(throng_boxes, is_static) == 128);
static_assert(layout<throng_double_boxes>(144, 8) && offsetof(throng_double_boxes, corner) == 8 &&
              offsetof(throng_double_boxes, stride_bytes) == 56 &&
              offsetof(throng_double_boxes, group) == 64 &&
              offsetof(throng_double_boxes, mask) == 80 &&
              offsetof(throng_double_boxes, owner) == 96 &&
              offsetof(throng_double_boxes, world) == 112 &&
              offsetof(throng_double_boxes, is_static) == 128);
static_assert(layout<throng_live_pair>(12, 4) && offsetof(throng_live_pair, slot) == 8);
static_assert(layout<throng_filter>(20, 4) && offsetof(throng_filter, mask) == 4 &&
              offsetof(throng_filter, owner) == 8 && offsetof(throng_filter, world) == 12 &&
              offsetof(throng_filter, is_static) == 16);
static_assert(layout<throng_sweep>(36, 4) && offsetof(throng_sweep, by) == 24);
static_assert(layout<throng_sweep_hit>(16, 8) && offsetof(throng_sweep_hit, object) == 4 &&
              offsetof(throng_sweep_hit, time) == 8);
static_assert(layout<throng_shape>(40, 4) && offsetof(throng_shape, center) == 4 &&
              offsetof(throng_shape, half_extents) == 16 && offsetof(throng_shape, radius) == 28 &&
              offsetof(throng_shape, first_point) == 32 &&
              offsetof(throng_shape, point_count) == 36);
static_assert(layout<throng_bodies>(120, 8) && offsetof(throng_bodies, position) == 8 &&
              offsetof(throng_bodies, rotation) == 24 &&
              offsetof(throng_bodies, displacement) == 40 && offsetof(throng_bodies, shape) == 56 &&
              offsetof(throng_bodies, shapes) == 72 && offsetof(throng_bodies, shape_count) == 88 &&
              offsetof(throng_bodies, points) == 96 && offsetof(throng_bodies, point_count) == 112);
static_assert(layout<throng_vertices>(32, 8) && offsetof(throng_vertices, floats) == 8 &&
              offsetof(throng_vertices, doubles) == 16 &&
              offsetof(throng_vertices, stride_bytes) == 24);
static_assert(layout<throng_elements>(24, 8) && offsetof(throng_elements, indices) == 8 &&
              offsetof(throng_elements, stride_bytes) == 16);
static_assert(layout<throng_mesh>(144, 8) && offsetof(throng_mesh, triangles) == 32 &&
              offsetof(throng_mesh, transform) == 56 && offsetof(throng_mesh, group) == 64 &&
              offsetof(throng_mesh, mask) == 80 && offsetof(throng_mesh, owner) == 96 &&
              offsetof(throng_mesh, world) == 112 && offsetof(throng_mesh, is_static) == 128);
static_assert(layout<throng_intersection>(152, 8) &&
              offsetof(throng_intersection, point_count) == 1 &&
              offsetof(throng_intersection, points) == 8);
static_assert(layout<throng_contact_mesh>(152, 8) && offsetof(throng_contact_mesh, end) == 32 &&
              offsetof(throng_contact_mesh, edges) == 64 &&
              offsetof(throng_contact_mesh, faces) == 88 &&
              offsetof(throng_contact_mesh, dimension) == 112 &&
              offsetof(throng_contact_mesh, rings) == 116 &&
              offsetof(throng_contact_mesh, group) == 120 &&
              offsetof(throng_contact_mesh, mask) == 136);

// These two may grow: the first new field of throng_options is at 104 or behind, that of
// throng_result at 168 or behind.
static_assert(sizeof(throng_options) >= 104 && alignof(throng_options) == 8 &&
              offsetof(throng_options, struct_bytes) == 0 &&
              offsetof(throng_options, algorithm) == 8 && offsetof(throng_options, order) == 12 &&
              offsetof(throng_options, backend) == 16 && offsetof(throng_options, nan) == 20 &&
              offsetof(throng_options, margin) == 24 && offsetof(throng_options, threads) == 28 &&
              offsetof(throng_options, memory_cap_bytes) == 32 &&
              offsetof(throng_options, concurrency) == 40 && offsetof(throng_options, run) == 48 &&
              offsetof(throng_options, run_self) == 56 &&
              offsetof(throng_options, allocate) == 64 &&
              offsetof(throng_options, deallocate) == 72 &&
              offsetof(throng_options, memory_self) == 80 && offsetof(throng_options, isa) == 88 &&
              offsetof(throng_options, stoppable) == 92 &&
              offsetof(throng_options, inverted) == 96);
static_assert(sizeof(throng_result) >= 168 && alignof(throng_result) == 8 &&
              offsetof(throng_result, struct_bytes) == 0 && offsetof(throng_result, status) == 8 &&
              offsetof(throng_result, found) == 16 && offsetof(throng_result, written) == 24 &&
              offsetof(throng_result, inactive) == 32 &&
              offsetof(throng_result, comparisons) == 40 &&
              offsetof(throng_result, first_invalid) == 48 &&
              offsetof(throng_result, invalid_count) == 56 &&
              offsetof(throng_result, bytes_needed) == 64 &&
              offsetof(throng_result, total_ms) == 72 && offsetof(throng_result, plan_ms) == 80 &&
              offsetof(throng_result, bin_ms) == 88 && offsetof(throng_result, find_ms) == 96 &&
              offsetof(throng_result, order_ms) == 104 && offsetof(throng_result, plan) == 112 &&
              offsetof(throng_result, message) == 120 && offsetof(throng_result, backend) == 128 &&
              offsetof(throng_result, algorithm) == 132 && offsetof(throng_result, isa) == 136 &&
              offsetof(throng_result, threads) == 140 && offsetof(throng_result, visited) == 144 &&
              offsetof(throng_result, candidates) == 152 &&
              offsetof(throng_result, exact_tests) == 160);
#endif

// A program that was built when `inverted`, the last field, did not exist: the memory behind its
// struct is neither written nor read.
TEST(CLayout, OlderOptions) {
  const std::size_t older = offsetof(throng_options, inverted);
  throng_options options;
  std::memset(static_cast<void*>(&options), 0x55, sizeof options);
  throng_options_init_sized(&options, older);
  EXPECT_EQ(options.struct_bytes, older);
  EXPECT_EQ(options.inverted, 0x55555555);
  const throng_box inverted = {{1, 0, 0}, {0, 1, 1}};
  const throng_boxes view = throng_boxes_packed(&inverted, 1);
  throng_finder* const finder = throng_finder_create(&options);
  EXPECT_EQ(throng_find(finder, &view, nullptr), THRONG_OK)
      << throng_finder_result(finder)->message;
  EXPECT_EQ(throng_finder_result(finder)->inactive, 1u);
  throng_finder_destroy(finder);
}

TEST(CLayout, EveryResultHasItsSize) {
  EXPECT_EQ(throng_finder_result(nullptr)->struct_bytes, sizeof(throng_result));
  EXPECT_STREQ(throng_finder_result(nullptr)->plan, "");
  throng_finder* const finder = throng_finder_create(nullptr);
  EXPECT_EQ(throng_finder_result(finder)->struct_bytes, sizeof(throng_result)) << "before a call";
  EXPECT_STREQ(throng_finder_result(finder)->message, "");
  EXPECT_EQ(throng_find(finder, nullptr, nullptr), THRONG_BAD_BOXES);
  EXPECT_EQ(throng_finder_result(finder)->struct_bytes, sizeof(throng_result));
  throng_finder_destroy(finder);
}

}  // namespace
}  // namespace throng::tests
