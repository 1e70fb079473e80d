// Device memory for pairs that are appended through a counter.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "apps/paper/search.hpp"

namespace throng::paper {

// A pair buffer that grows until all pairs fit.
template <class Device>
class PairList {
 public:
  explicit PairList(std::uint64_t n) : first_capacity_(4 * n + 1024) {}

  // launch(sink) sends each pair to the sink. If they exceed the capacity, the buffer grows and
  // launch runs again: none is lost, and nothing is written past the end.
  template <class Launch>
  void collect(Device& device, const Launch& launch) {
    counter_.reserve(1);
    pairs_.reserve(first_capacity_);
    for (;;) {
      device.zero(counter_, 1);
      launch(PairSink{pairs_.data(), pairs_.size(), counter_.data()});
      count_ = device.read(counter_.data());
      if (count_ <= pairs_.size()) return;
      pairs_.reserve(count_ + count_ / 8);
    }
  }

  const Pair* fetch(Device& device) { return device.fetch(pairs_, count_); }
  std::uint64_t count() const noexcept { return count_; }

 private:
  typename Device::template Array<std::uint64_t> counter_;
  typename Device::template Array<Pair> pairs_;
  std::uint64_t first_capacity_;
  std::uint64_t count_ = 0;
};

}  // namespace throng::paper
