// The WebAssembly module is the C API. JavaScript writes and reads its structs by offset: these are
// the offsets in web/src/layout.js.
#include <throng/throng.h>

#include <cstddef>
#include <cstdlib>
#include <new>

static_assert(sizeof(void*) == 4 && sizeof(size_t) == 4);

static_assert(sizeof(throng_boxes) == 72 && offsetof(throng_boxes, corner) == 4 &&
              offsetof(throng_boxes, stride_bytes) == 28 && offsetof(throng_boxes, group) == 32 &&
              offsetof(throng_boxes, mask) == 40 && offsetof(throng_boxes, owner) == 48 &&
              offsetof(throng_boxes, world) == 56 && offsetof(throng_boxes, is_static) == 64);

static_assert(offsetof(throng_options, algorithm) == 4 && offsetof(throng_options, order) == 8 &&
              offsetof(throng_options, nan) == 16 && offsetof(throng_options, margin) == 20 &&
              offsetof(throng_options, isa) == 56 && offsetof(throng_options, inverted) == 64 &&
              sizeof(throng_options) == 68);

static_assert(offsetof(throng_result, status) == 4 && offsetof(throng_result, found) == 8 &&
              offsetof(throng_result, written) == 16 && offsetof(throng_result, inactive) == 24 &&
              offsetof(throng_result, comparisons) == 32 &&
              offsetof(throng_result, first_invalid) == 40 &&
              offsetof(throng_result, invalid_count) == 48 &&
              offsetof(throng_result, bytes_needed) == 56 &&
              offsetof(throng_result, total_ms) == 64 && offsetof(throng_result, plan) == 104 &&
              offsetof(throng_result, message) == 108 &&
              offsetof(throng_result, algorithm) == 116 && offsetof(throng_result, isa) == 120);

static_assert(sizeof(throng_live_pair) == 12 && sizeof(throng_pair) == 8);
static_assert(sizeof(throng_sweep) == 36 && offsetof(throng_sweep, by) == 24);
static_assert(sizeof(throng_sweep_hit) == 16 && offsetof(throng_sweep_hit, time) == 8);
static_assert(sizeof(throng_ray_hit) == 40 && offsetof(throng_ray_hit, distance) == 8 &&
              offsetof(throng_ray_hit, point) == 16 && offsetof(throng_ray_hit, normal) == 28);
static_assert(sizeof(throng_filter) == 20 && offsetof(throng_filter, owner) == 8 &&
              offsetof(throng_filter, is_static) == 16);

// There are no exceptions: a throw, which in this module only a lack of memory causes, ends the
// instance. JavaScript then reads whether that was it, and the number of bytes, 0 if unknown.
extern "C" {
size_t throng_web_lack[2] = {0, 0};

void* __cxa_allocate_exception(size_t) noexcept {
  alignas(16) static unsigned char object[128];
  return object;
}
[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) {
  throng_web_lack[0] = 1;
  __builtin_trap();
}
}

namespace {

void* allocated(void* block, std::size_t bytes) {
  if (block) return block;
  throng_web_lack[0] = 1;
  throng_web_lack[1] = bytes;
  __builtin_trap();
}

}  // namespace

void* operator new(std::size_t bytes) { return allocated(std::malloc(bytes), bytes); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocated(std::aligned_alloc(static_cast<std::size_t>(alignment), bytes), bytes);
}
