// Square roots alone, as timed in the paper's Table 4, on any device.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/common/median.hpp"
#include "apps/paper/roots.hpp"
#include "apps/paper/stepper.hpp"
#include "base/host_device_macros.hpp"

namespace throng::paper {

// With all choices as compile-time constants, as in a program that has only this one.
template <std::uint32_t constant, int steps>
struct FixedRoot {
  using Real = float;
  THRONG_HD constexpr float operator()(float x) const noexcept {
    return x * fast_inverse_root<float>(x, constant, steps);
  }
};

// Thread t computes every `stride`-th root from t on and stores the sum of their integer parts.
template <class Root>
struct SumRoots {
  Root root;
  std::uint64_t count, stride;
  std::uint64_t* sums;

  THRONG_HD void operator()(std::uint64_t t) const noexcept {
    std::uint64_t sum = 0;
    for (std::uint64_t i = t; i < count; i += stride) {
      using Real = typename Root::Real;
      // Through 32 bits, wide enough for the paper's counts: one instruction, on either side.
      sum += static_cast<std::uint32_t>(root(static_cast<Real>(static_cast<std::uint32_t>(i))));
    }
    sums[t] = sum;
  }
};

// count < 2^32.
template <class Device, class Root>
RootTime time_root(Device& device, const Root& root, std::uint64_t count, int repeat) {
  const std::uint64_t threads = count / 16 + 1;
  typename Device::template Array<std::uint64_t> sums;
  sums.reserve(threads);
  const SumRoots<Root> run{root, count, threads, sums.data()};
  device.each(threads, run);
  std::vector<double> times;
  for (int i = 0; i < repeat; ++i) {
    device.restart();
    device.each(threads, run);
    device.mark();
    device.finish();
    times.push_back(device.ms(0));
  }
  RootTime result{common::median(times), 0};
  const std::uint64_t* fetched = device.fetch(sums, threads);
  device.finish();
  for (std::uint64_t t = 0; t < threads; ++t) result.sum += fetched[t];
  return result;
}

template <std::uint32_t constant, class Device>
RootTime time_fast(Device& device, int steps, std::uint64_t count, int repeat) {
  switch (steps) {
    case 1:
      return time_root(device, FixedRoot<constant, 1>{}, count, repeat);
    case 2:
      return time_root(device, FixedRoot<constant, 2>{}, count, repeat);
    case 3:
      return time_root(device, FixedRoot<constant, 3>{}, count, repeat);
    default:
      return time_root(device, FixedRoot<constant, 4>{}, count, repeat);
  }
}

template <class Device>
RootTime time_roots(Device& device, RootKind kind, int steps, std::uint64_t count, int repeat) {
  switch (kind) {
    case RootKind::carmack:
      return time_fast<carmack_constant>(device, steps, count, repeat);
    case RootKind::lomont:
      return time_fast<lomont_constant>(device, steps, count, repeat);
    case RootKind::float32:
      return time_root(device, HardwareRoot<float>{}, count, repeat);
    default:
      return time_root(device, HardwareRoot<double>{}, count, repeat);
  }
}

}  // namespace throng::paper
