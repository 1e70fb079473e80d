// Device memory for the pairs of a search: the array that grows, and what sorting needs.
#pragma once

#include <algorithm>
#include <cstddef>

#include <throng/finder.hpp>

#include "cuda/device.cuh"
#include "device/device_buffer.hpp"

namespace throng::cuda {

class PairMemory {
 public:
  explicit PairMemory(Device& device) noexcept
      : unordered_(device), sorting_(device), found_(device) {}

  // Memory to sort `pairs`. If it runs out midway, none counts as reserved.
  void reserve(std::size_t pairs) {
    if (pairs <= reserved_) return;
    reserved_ = 0;
    unordered_.ensure(pairs * sizeof(Pair));
    sorting_.ensure(Device::sort_bytes(pairs));
    reserved_ = pairs;
  }
  // Whether a search with this order and capacity needs no more memory.
  bool suffices(Order order, std::size_t capacity) const noexcept {
    return order == Order::any || capacity <= reserved_;
  }

  // Where a search writes its pairs: `out`, or memory that sort() reads.
  Pair* target(Order order, Pair* out) const noexcept {
    return order == Order::canonical ? unordered_.as<Pair>() : out;
  }
  void sort(Device& device, Pair* out, std::size_t capacity, const Report* report,
            const device::Input& in) const {
    device.sort(unordered_.as<Pair>(), sorting_.as<char>(), sorting_.bytes(), out, capacity,
                capacity, report, in);
    device.mark(device::Stage::order);
  }

  // Repeats search(out, capacity), which writes r, with more memory until all pairs fit.
  template <class R, class Search>
  Pairs grow(std::size_t wanted, R& r, const Search& search) {
    for (const R fresh = r;; r = fresh) {
      if (wanted > found_.bytes() / sizeof(Pair)) found_.ensure(wanted * sizeof(Pair));
      search(found_.as<Pair>(), found_.bytes() / sizeof(Pair));
      if (r.status != Status::buffer_too_small)
        return {found_.as<Pair>(), static_cast<std::size_t>(r.written)};
      wanted = static_cast<std::size_t>(r.found + r.found / 64 + 512);
    }
  }

  std::size_t bytes() const noexcept {
    return unordered_.bytes() + sorting_.bytes() + found_.bytes();
  }

 private:
  device::DeviceBuffer<Device> unordered_, sorting_, found_;
  std::size_t reserved_ = 0;  // pairs that can be sorted
};

// Writes how many pairs a search found and wrote.
inline void set_counts(const Report& report, Order order, std::size_t capacity,
                       Result& r) noexcept {
  r.found = report.found;
  r.written = order == Order::canonical && r.found > capacity
                  ? 0
                  : std::min<std::uint64_t>(r.found, capacity);
  if (r.found > capacity) r.status = Status::buffer_too_small;
}

}  // namespace throng::cuda
