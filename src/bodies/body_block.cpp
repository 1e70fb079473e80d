// The kernel for a block of bodies, compiled once per instruction set: plain C++ that the compiler
// vectorizes. All instruction sets give the same bits, as none contracts or reorders
// (-ffp-contract=off).
#if defined(THRONG_HIGHWAY)
// Built: SSE4, AVX2, AVX-512, as for the pair kernels. On ARM the baseline includes vectors.
#define HWY_DISABLED_TARGETS                                                                     \
  ((1LL << 12) | (1LL << 7) | (1LL << 6) | (1LL << 5) | (1LL << 4) | (1LL << 24) | (1LL << 25) | \
   (1LL << 26) | (1LL << 27))
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bodies/body_block.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>
#else
#define HWY_BEFORE_NAMESPACE() static_assert(true)
#define HWY_AFTER_NAMESPACE() static_assert(true)
#define HWY_NAMESPACE plain
#define HWY_ONCE 1
#endif

#include "base/body_bounds.hpp"
#include "bodies/body_boxes.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::bodies::HWY_NAMESPACE {

// All callees must be inlined, or they would not be compiled for this instruction set.
template <bool rotated, bool displaced>
#if defined(__GNUC__)
[[gnu::flatten]]
#endif
void bound_block(BodyBlock& b, float margin) {
  for (std::size_t i = 0; i < BodyBlock::size; ++i) {
    const Vec3 center = {b.center[0][i], b.center[1][i], b.center[2][i]};
    const Vec3 half = {b.half_extents[0][i], b.half_extents[1][i], b.half_extents[2][i]};
    const double radius = static_cast<double>(b.radius[i]) + static_cast<double>(margin);
    base::Extents extents;
    if constexpr (rotated) {
      extents =
          base::extents_of({b.rotation[0][i], b.rotation[1][i], b.rotation[2][i], b.rotation[3][i]},
                           center, half, radius);
    } else {
      extents = base::extents_of(center, half, radius);
    }
    const Vec3 position = {b.position[0][i], b.position[1][i], b.position[2][i]};
    Box box;
    if constexpr (displaced) {
      box = base::place(
          position, {b.displacement[0][i], b.displacement[1][i], b.displacement[2][i]}, extents);
    } else {
      box = base::place(position, extents);
    }
    b.lower[0][i] = box.lower.x;
    b.lower[1][i] = box.lower.y;
    b.lower[2][i] = box.lower.z;
    b.upper[0][i] = box.upper.x;
    b.upper[1][i] = box.upper.y;
    b.upper[2][i] = box.upper.z;
  }
}

inline BlockKernel choose(bool rotated, bool displaced) {
  return rotated     ? displaced ? &bound_block<true, true> : &bound_block<true, false>
             : displaced ? &bound_block<false, true>
                     : &bound_block<false, false>;
}

}  // namespace throng::bodies::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace throng::bodies {

// The scalar one and any that was not built use the baseline.
BlockKernel find_block_kernel(Isa isa, bool rotated, bool displaced) noexcept {
#if defined(THRONG_HIGHWAY)
#if HWY_TARGETS & HWY_AVX3
  if (isa == Isa::avx512) return N_AVX3::choose(rotated, displaced);
#endif
#if HWY_TARGETS & HWY_AVX2
  if (isa == Isa::avx2) return N_AVX2::choose(rotated, displaced);
#endif
#if HWY_TARGETS & HWY_SSE4
  if (isa == Isa::sse4) return N_SSE4::choose(rotated, displaced);
#endif
#endif
  (void)isa;
  return HWY_NAMESPACE::choose(rotated, displaced);
}

}  // namespace throng::bodies
#endif
