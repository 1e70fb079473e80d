// The vector kernels, compiled by Highway once per instruction set.
//
// Quantized coordinates have 15 bits, so the difference of two fits int16. The sign of a pair's
// least difference says whether the boxes overlap, are separate, or tie.
#if defined(THRONG_HIGHWAY)

#include "base/highway_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "grid/sweep/kernels_simd.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

#include "grid/sweep/kernel_table.hpp"

#if HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3_DL || \
    HWY_TARGET == HWY_NEON || HWY_TARGET == HWY_WASM

#include "grid/bin/kernels_bin-inl.hpp"
#include "grid/bin/kernels_filters-inl.hpp"
#include "grid/kernels_all_pairs-inl.hpp"
#include "grid/order/kernels_sort_lists-inl.hpp"
#include "grid/order/kernels_sort_runs-inl.hpp"
#include "grid/sweep/kernels_sweep-inl.hpp"
#include "grid/sweep/kernels_transpose-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {

const Kernels& kernels() {
  constexpr Isa isa = HWY_TARGET == HWY_SSE4      ? Isa::sse4
                      : HWY_TARGET == HWY_AVX2    ? Isa::avx2
                      : HWY_TARGET == HWY_AVX3_DL ? Isa::avx512
                      : HWY_TARGET == HWY_NEON    ? Isa::neon
                      : HWY_TARGET == HWY_WASM    ? Isa::wasm
                                                  : Isa::automatic;
  static_assert(isa != Isa::automatic, "the name of this target");
  constexpr std::uint32_t pairs_per_vector = hn::MaxLanes(hn::CappedTag<std::uint64_t, 8>());
  const base::SweepCost* const cost =
      coordinate_lanes > 8 ? &base::cost.sweep_wide : &base::cost.sweep_narrow;
  static const Kernels table = [cost] {
    Kernels all{
        isa,         cost,      bin,     quantized_range, transpose, sweep, match_filter_classes,
        read_worlds, all_pairs, nullptr, nullptr};
    // With fewer than four pairs per vector the radix sort is faster.
    if constexpr (pairs_per_vector >= 4) {
      all.sort_lists = sort_lists<pairs_per_vector>;
      all.sort_runs = sort_runs<pairs_per_vector>;
    }
    return all;
  }();
  return table;
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

#if HWY_ONCE
namespace throng::grid {
#if HWY_ARCH_X86
namespace {

// The targets that the processor and operating system support. Uses compiler builtins, so that
// linking needs only Highway's headers.
long long supported_targets() noexcept {
#if defined(__GNUC__)
  const bool sse4 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("pclmul") &&
                    __builtin_cpu_supports("aes");
  const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  const bool avx3 = avx2 && __builtin_cpu_supports("avx512f") &&
                    __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
                    __builtin_cpu_supports("avx512ifma") && __builtin_cpu_supports("avx512vbmi") &&
                    __builtin_cpu_supports("avx512vbmi2") && __builtin_cpu_supports("avx512vnni") &&
                    __builtin_cpu_supports("avx512bitalg") &&
                    __builtin_cpu_supports("avx512vpopcntdq");
  return (sse4 ? HWY_SSE4 : 0LL) | (avx2 ? HWY_AVX2 : 0LL) | (avx3 ? HWY_AVX3_DL : 0LL);
#else
  return static_cast<long long>(hwy::SupportedTargets());
#endif
}

}  // namespace
#endif

const Kernels* simd_kernels(Isa isa) noexcept {
#if HWY_ARCH_X86
  // Cached: CPUID takes microseconds in a virtual machine.
  static const long long supported = supported_targets();
  const auto has = [](long long target) { return (supported & target) != 0; };
#if HWY_TARGETS & HWY_AVX3_DL
  if (isa == Isa::avx512 && has(HWY_AVX3_DL)) return &N_AVX3_DL::kernels();
#endif
#if HWY_TARGETS & HWY_AVX2
  if (isa == Isa::avx2 && has(HWY_AVX2)) return &N_AVX2::kernels();
#endif
#if HWY_TARGETS & HWY_SSE4
  if (isa == Isa::sse4 && has(HWY_SSE4)) return &N_SSE4::kernels();
#endif
#elif HWY_TARGETS & HWY_NEON
  if (isa == Isa::neon) return &N_NEON::kernels();
#elif HWY_TARGETS & HWY_WASM
  if (isa == Isa::wasm) return &N_WASM::kernels();
#endif
  (void)isa;
  return nullptr;
}

}  // namespace throng::grid
#endif

#else

#include "grid/sweep/kernel_table.hpp"
namespace throng::grid {
const Kernels* simd_kernels(Isa) noexcept { return nullptr; }
}  // namespace throng::grid

#endif
