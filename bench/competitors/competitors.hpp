// The baselines and the other libraries. They are a shared library of their own, which is built
// with -O3 -march=native and shares no inlined code with the rest of the benchmark.
#pragma once

#include <string>
#include <vector>

#include "method.hpp"

namespace throng::bench {

#if defined(__GNUC__)
#define THRONG_BENCH_EXPORT __attribute__((visibility("default")))
#else
#define THRONG_BENCH_EXPORT
#endif

MethodInfo baseline_box_by_box();
MethodInfo baseline_ranges();
std::vector<MethodInfo> bullet_methods();
std::vector<MethodInfo> embree_methods();
std::vector<MethodInfo> cgal_methods();
std::vector<MethodInfo> fcl_methods();

// All that were built, the baselines first.
THRONG_BENCH_EXPORT std::vector<MethodInfo> competitor_methods();
// "Embree 3.13.5", ...; and those that were not found, each with the package to install.
THRONG_BENCH_EXPORT std::vector<std::string> competitor_versions();
THRONG_BENCH_EXPORT std::vector<std::string> missing_competitors();

}  // namespace throng::bench
