// Times of device work: warmed up, an event before and after each run, the median of many runs.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "apps/common/median.hpp"
#include "bench/gpu/gpu.hpp"
#include "bench/gpu/measurement.hpp"

namespace throng::bench::gpu {

// run(k) adds the k-th run to the stream. As many runs as fit into `budget_ms`, at least 10.
template <class F>
Timing time_runs(cudaStream_t stream, double budget_ms, const F& run) {
  // Events per batch. The host waits after each batch, so that its queue of launches stays short.
  constexpr std::size_t batch = 64;
  static const std::array<Event, batch> starts, ends;
  std::size_t k = 0;
  // Warm-up: three runs. The time of the last one determines the number of runs.
  for (; k < 3; ++k) {
    starts[0].record(stream);
    run(k);
    ends[0].record(stream);
  }
  ends[0].wait();
  const double once = std::max(ends[0].ms_since(starts[0]), 1e-3);
  const auto wanted = static_cast<std::size_t>(std::clamp(budget_ms / 2 / once, 10.0, 4000.0));
  Timing t;
  std::vector<double> times;
  while (times.size() < wanted) {
    const std::size_t size = std::min(batch, wanted - times.size());
    for (std::size_t j = 0; j < size; ++j) {
      starts[j].record(stream);
      run(k++);
      ends[j].record(stream);
    }
    ends[size - 1].wait();
    for (std::size_t j = 0; j < size; ++j) times.push_back(ends[j].ms_since(starts[j]));
  }
  starts[0].record(stream);
  for (std::size_t j = 0; j < wanted; ++j) run(k++);
  ends[0].record(stream);
  ends[0].wait();
  t.back_to_back_ms = ends[0].ms_since(starts[0]) / static_cast<double>(wanted);
  t.min_ms = *std::min_element(times.begin(), times.end());
  t.runs = times.size();
  t.median_ms = common::median(std::move(times));
  return t;
}

}  // namespace throng::bench::gpu
