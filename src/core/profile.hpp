// Ranges that a profiler shows on its timeline: Tracy's, or NVTX for Nsight Systems. A build has
// none unless THRONG_PROFILER asks for one (CMake), and then a range is no code at all.
#pragma once

#if defined(THRONG_PROFILER_NVTX)
#include <nvtx3/nvtx3.hpp>
namespace throng::core {
struct ProfilerDomain {
  static constexpr const char* name = "throng";
};
}  // namespace throng::core
// From here to the end of the scope. The name is a string literal.
#define THRONG_RANGE(name) \
  const nvtx3::scoped_range_in<throng::core::ProfilerDomain> throng_range(name)
#elif defined(THRONG_PROFILER_TRACY)
#include <tracy/Tracy.hpp>
#define THRONG_RANGE(name) ZoneScopedN("throng: " name)
#else
#define THRONG_RANGE(name) static_cast<void>(0)
#endif
