// The mapping from thread to pair alone, without boxes and output, on any device.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/common/median.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/search.hpp"
#include "apps/paper/stepper.hpp"
#include "apps/paper/variant.hpp"
#include "base/host_device_macros.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {

// Worker w computes every `stride`-th pair from w on, and stores a sum that depends on all of them.
template <class Mapping>
struct SumPairs {
  Mapping mapping;
  std::uint64_t n, threads, stride;
  std::uint64_t* sums;

  THRONG_HD void operator()(std::uint64_t w) const noexcept {
    std::uint64_t sum = 0;
    for (std::uint64_t t = w; t < threads; t += stride) {
      Pair pair{};
      if (mapping(t, n, pair)) sum += pair.first + 3 * std::uint64_t{pair.second};
    }
    sums[w] = sum;
  }
};

template <class Device>
MappingTime time_mapping(Device& device, const Variant& variant, std::uint64_t n, int repeat) {
  const std::uint64_t threads = thread_count(variant, n);
  const std::uint64_t workers = threads / 64 + 1;
  typename Device::template Array<std::uint64_t> sums;
  typename Device::template Array<Pair> list;
  sums.reserve(workers);
  if (variant.mapping == MappingKind::stored) {
    list.reserve(threads);
    device.each(threads, FillList<Exact>{Exact{}, n, list.data()});
  }
  return with_mapping(variant, list.data(), [&](const auto& mapping) {
    using Mapping = std::decay_t<decltype(mapping)>;
    const SumPairs<Mapping> run{mapping, n, threads, workers, sums.data()};
    device.each(workers, run);
    std::vector<double> times;
    for (int i = 0; i < repeat; ++i) {
      device.restart();
      device.each(workers, run);
      device.mark();
      device.finish();
      times.push_back(device.ms(0));
    }
    MappingTime result{common::median(times), 0};
    const std::uint64_t* fetched = device.fetch(sums, workers);
    device.finish();
    for (std::uint64_t w = 0; w < workers; ++w) result.sum += fetched[w];
    return result;
  });
}

}  // namespace throng::paper
