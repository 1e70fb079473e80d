// What Throng is measured against. Lives in a library of its own that is built -O3 -march=native
// and shares no inlined code with the rest of the benchmark.
#pragma once

#include <string>
#include <vector>

#include "contender.hpp"

namespace throng::bench {

#if defined(__GNUC__)
#define THRONG_BENCH_EXPORT __attribute__((visibility("default")))
#else
#define THRONG_BENCH_EXPORT
#endif

Entry plain_boxes();
Entry plain_ranges();
std::vector<Entry> bullet_entries();
std::vector<Entry> embree_entries();
std::vector<Entry> cgal_entries();
std::vector<Entry> fcl_entries();

// All that were built, the yardsticks first.
THRONG_BENCH_EXPORT std::vector<Entry> rival_entries();
// "Embree 3.13.5", ... and those that were not found, each with the package that brings it.
THRONG_BENCH_EXPORT std::vector<std::string> rival_versions();
THRONG_BENCH_EXPORT std::vector<std::string> missing_rivals();

}  // namespace throng::bench
