// Ranges for a profiler's timeline: Tracy, or NVTX for Nsight Systems. They compile to nothing
// unless the CMake option THRONG_PROFILER selects one.
#pragma once

#if defined(THRONG_PROFILER_NVTX)
#include <nvtx3/nvtx3.hpp>
namespace throng::base {
struct ProfilerDomain {
  static constexpr const char* name = "throng";
};
}  // namespace throng::base
// Lasts until the end of the scope. The name is a string literal.
#define THRONG_RANGE(name) \
  const nvtx3::scoped_range_in<throng::base::ProfilerDomain> throng_range(name)
#elif defined(THRONG_PROFILER_TRACY)
#include <tracy/Tracy.hpp>
#define THRONG_RANGE(name) ZoneScopedN("throng: " name)
#else
#define THRONG_RANGE(name) static_cast<void>(0)
#endif
