// C API of the Finder, implemented with the C++ API. Persistent objects are in c_broad_phase.cpp.
#include <throng/throng.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>

#include <throng/find_pairs.hpp>
#include <throng/finder.hpp>
#include <throng/options.hpp>
#include <throng/update_boxes.hpp>
#include <throng/version.hpp>

#include "c_api_common.hpp"

namespace throng {
namespace {

constexpr bool equal(throng_status c, Status cpp) noexcept {
  return static_cast<int>(c) == static_cast<int>(cpp);
}
static_assert(
    equal(THRONG_OK, Status::ok) && equal(THRONG_BUFFER_TOO_SMALL, Status::buffer_too_small) &&
    equal(THRONG_STOPPED, Status::stopped) && equal(THRONG_NAN_BOX, Status::nan_box) &&
    equal(THRONG_BAD_BOXES, Status::bad_boxes) && equal(THRONG_BAD_FILTER, Status::bad_filter) &&
    equal(THRONG_BAD_OPTION, Status::bad_option) &&
    equal(THRONG_TOO_MANY_BOXES, Status::too_many_boxes) &&
    equal(THRONG_OUT_OF_MEMORY, Status::out_of_memory) &&
    equal(THRONG_MEMORY_CAP_TOO_SMALL, Status::memory_cap_too_small) &&
    equal(THRONG_UNSUPPORTED_ISA, Status::unsupported_isa) &&
    equal(THRONG_NO_DEVICE, Status::no_device) &&
    equal(THRONG_DEVICE_ERROR, Status::device_error) &&
    equal(THRONG_NOT_RESERVED, Status::not_reserved) &&
    equal(THRONG_BAD_BODIES, Status::bad_bodies) && equal(THRONG_BAD_SHAPE, Status::bad_shape) &&
    equal(THRONG_BAD_ID, Status::bad_id) && equal(THRONG_BUSY, Status::busy) &&
    equal(THRONG_INVERTED_BOX, Status::inverted_box) && equal(THRONG_BAD_MESH, Status::bad_mesh));
static_assert(THRONG_ALGORITHM_GRID == static_cast<int>(Algorithm::grid) &&
              THRONG_ALGORITHM_ALL_PAIRS == static_cast<int>(Algorithm::all_pairs) &&
              THRONG_ORDER_CANONICAL == static_cast<int>(Order::canonical) &&
              THRONG_BACKEND_CPU == static_cast<int>(Backend::cpu) &&
              THRONG_BACKEND_CUDA == static_cast<int>(Backend::cuda) &&
              THRONG_BACKEND_EMULATED == static_cast<int>(Backend::emulated) &&
              THRONG_NAN_INACTIVE == static_cast<int>(NanPolicy::inactive) &&
              THRONG_INVERTED_REFUSE == static_cast<int>(InvertedPolicy::refuse) &&
              THRONG_INVERTED_INACTIVE == static_cast<int>(InvertedPolicy::inactive) &&
              THRONG_ISA_SCALAR == static_cast<int>(Isa::scalar) &&
              THRONG_ISA_SSE4 == static_cast<int>(Isa::sse4) &&
              THRONG_ISA_AVX2 == static_cast<int>(Isa::avx2) &&
              THRONG_ISA_AVX512 == static_cast<int>(Isa::avx512) &&
              THRONG_ISA_NEON == static_cast<int>(Isa::neon) &&
              THRONG_ISA_WASM == static_cast<int>(Isa::wasm));
static_assert(sizeof(throng_box) == sizeof(Box) && sizeof(throng_pair) == sizeof(Pair) &&
              alignof(throng_pair) == alignof(Pair));
static_assert(sizeof(throng_shape) == sizeof(Shape) &&
              offsetof(throng_shape, center) == offsetof(Shape, center) &&
              offsetof(throng_shape, half_extents) == offsetof(Shape, half_extents) &&
              offsetof(throng_shape, radius) == offsetof(Shape, radius) &&
              offsetof(throng_shape, first_point) == offsetof(Shape, first_point) &&
              offsetof(throng_shape, point_count) == offsetof(Shape, point_count) &&
              THRONG_SHAPE_BOX == static_cast<int>(ShapeKind::box) &&
              THRONG_SHAPE_CONVEX == static_cast<int>(ShapeKind::convex) &&
              sizeof(Quaternion) == 4 * sizeof(float));

}  // namespace
}  // namespace throng

struct throng_finder : throng::c_api::Handle {
  explicit throng_finder(const throng_options& given) noexcept : Handle(given), finder(options()) {}

  throng::Finder finder;
};

namespace {

using throng::c_api::view;
using ConsumerFunction = int (*)(void* context, const throng_pair* pairs, size_t count);

// Runs call(view of a), or with a second set call(both views). C is throng_boxes or
// throng_double_boxes.
template <class C, class Call>
throng_status search(throng_finder* finder, const C* a, const C* b, const Call& call) noexcept {
  return throng::c_api::run_call(finder, a != nullptr, "boxes",
                                 [&] { return b ? call(view(*a), view(*b)) : call(view(*a)); });
}

template <class C>
throng_status find(throng_finder* finder, const C* a, const C* b) noexcept {
  return search(finder, a, b, [&](const auto&... sets) { return finder->finder.find(sets...); });
}

template <class C>
throng_status find_into(throng_finder* finder, const C* a, const C* b, throng_pair* out,
                        size_t capacity) noexcept {
  auto* const pairs = reinterpret_cast<throng::Pair*>(out);
  return search(finder, a, b,
                [&](const auto&... sets) { return finder->finder.find(sets..., pairs, capacity); });
}

template <class C>
throng_status consume(throng_finder* finder, const C* a, const C* b, ConsumerFunction consumer,
                      void* context) noexcept {
  const auto take = [&](const throng::Pair* pairs, std::size_t count) {
    return consumer(context, reinterpret_cast<const throng_pair*>(pairs), count) != 0;
  };
  if (!consumer) {
    return throng::c_api::run_call(
        finder, true, "", [] { return throng::c_api::bad_option("found no consumer (NULL)"); });
  }
  return search(finder, a, b,
                [&](const auto&... sets) { return finder->finder.consume(sets..., take); });
}

// Boxes whose corners are `stride` values apart; null corners: empty.
template <class C, class Real>
C boxes_of(const Real* lower, const Real* upper, size_t stride, size_t count) noexcept {
  C b{};
  b.count = count;
  b.stride_bytes = stride * sizeof(Real);
  for (int k = 0; k < 3; ++k) {
    b.corner[k] = lower ? lower + k : nullptr;
    b.corner[3 + k] = upper ? upper + k : nullptr;
  }
  return b;
}

}  // namespace

extern "C" {

throng_boxes throng_boxes_packed(const throng_box* boxes, size_t count) {
  const auto* first = reinterpret_cast<const float*>(boxes);
  return boxes_of<throng_boxes>(first, first ? first + 3 : nullptr, 6, count);
}
throng_boxes throng_boxes_strided(const throng_box* first, size_t count, size_t stride_bytes) {
  throng_boxes boxes = throng_boxes_packed(first, count);
  if (stride_bytes != 0) boxes.stride_bytes = stride_bytes;
  return boxes;
}
throng_boxes throng_boxes_split(const float* lower, const float* upper, size_t count) {
  return boxes_of<throng_boxes>(lower, upper, 3, count);
}
throng_double_boxes throng_double_boxes_packed(const double* boxes, size_t count) {
  return boxes_of<throng_double_boxes>(boxes, boxes ? boxes + 3 : nullptr, 6, count);
}
throng_double_boxes throng_double_boxes_split(const double* lower, const double* upper,
                                              size_t count) {
  return boxes_of<throng_double_boxes>(lower, upper, 3, count);
}

void throng_options_init_sized(throng_options* options, size_t struct_bytes) {
  // A caller built against an older header has a shorter struct: write only its fields.
  if (!options) return;
  throng_options defaults{};
  defaults.struct_bytes = struct_bytes;
  std::memcpy(options, &defaults, std::min(struct_bytes, sizeof defaults));
}

throng_finder* throng_finder_create(const throng_options* options) {
  return new (std::nothrow) throng_finder(throng::c_api::complete_options(options));
}

void throng_finder_destroy(throng_finder* finder) { delete finder; }

throng_status throng_find(throng_finder* finder, const throng_boxes* a, const throng_boxes* b) {
  return find(finder, a, b);
}
throng_status throng_find_doubles(throng_finder* finder, const throng_double_boxes* a,
                                  const throng_double_boxes* b) {
  return find(finder, a, b);
}

const throng_pair* throng_finder_pairs(const throng_finder* finder, size_t* count) {
  const throng::Pairs pairs = finder ? finder->finder.pairs() : throng::Pairs();
  if (count) *count = pairs.size();
  return reinterpret_cast<const throng_pair*>(pairs.data());
}

throng_status throng_find_into(throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
                               throng_pair* out, size_t capacity) {
  return find_into(finder, a, b, out, capacity);
}
throng_status throng_find_doubles_into(throng_finder* finder, const throng_double_boxes* a,
                                       const throng_double_boxes* b, throng_pair* out,
                                       size_t capacity) {
  return find_into(finder, a, b, out, capacity);
}

throng_status throng_consume(throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
                             ConsumerFunction consumer, void* context) {
  return consume(finder, a, b, consumer, context);
}
throng_status throng_consume_doubles(throng_finder* finder, const throng_double_boxes* a,
                                     const throng_double_boxes* b, ConsumerFunction consumer,
                                     void* context) {
  return consume(finder, a, b, consumer, context);
}

throng_status throng_update_boxes(throng_finder* finder, const throng_bodies* bodies, float margin,
                                  throng_box* out, size_t stride_bytes) {
  return throng::c_api::run_call(finder, bodies != nullptr, "bodies", [&] {
    using throng::c_api::strided;
    throng::Bodies b;
    b.position = strided<throng::Vec3>(bodies->position, bodies->count);
    b.position.count = bodies->count;  // NULL is an error, not the absence of bodies
    b.rotation = strided<throng::Quaternion>(bodies->rotation, bodies->count);
    b.displacement = strided<throng::Vec3>(bodies->displacement, bodies->count);
    b.shape = strided<std::uint32_t>(bodies->shape, bodies->count);
    b.shapes = strided<throng::Shape>(bodies->shapes, bodies->shape_count);
    b.points = strided<throng::Vec3>(bodies->points, bodies->point_count);
    const throng::Options& of_finder = finder->options();
    throng::UpdateOptions options;
    options.margin = margin;
    options.threads = of_finder.threads;
    options.isa = of_finder.isa;
    options.executor = of_finder.executor;
    options.stop = of_finder.stop;
    return throng::update_boxes(b, reinterpret_cast<throng::Box*>(out), options,
                                stride_bytes != 0 ? stride_bytes : sizeof(throng_box));
  });
}

throng_box throng_round_outward(const double* lower, const double* upper) {
  return std::bit_cast<throng_box>(throng::round_outward(lower, upper));
}

throng_box throng_box_from_center(const float* center, const float* half_size) {
  return std::bit_cast<throng_box>(throng::box_from_center(
      {center[0], center[1], center[2]}, {half_size[0], half_size[1], half_size[2]}));
}

const throng_result* throng_finder_result(const throng_finder* finder) {
  return throng::c_api::result_of(finder);
}

void throng_finder_stop(throng_finder* finder) {
  if (finder) finder->stop();
}

size_t throng_finder_memory_bytes(const throng_finder* finder) {
  return finder ? finder->finder.memory_bytes() : 0;
}

const char* throng_status_text(throng_status status) {
  // throng::Status is one byte wide.
  const auto number = std::bit_cast<std::uint32_t>(status);  // C may pass any value
  return number < 256 ? throng::to_string(static_cast<throng::Status>(number)) : "unknown";
}

const char* throng_version(void) { return THRONG_VERSION; }
unsigned throng_c_version(void) { return THRONG_C_VERSION; }

}  // extern "C"
