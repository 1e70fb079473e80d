// The grid on any device: the launched functions, their order and their memory.
#pragma once

#include <cstdint>
#include <string>

#include "apps/paper/grid.hpp"
#include "apps/paper/pair_list.hpp"
#include "apps/paper/search.hpp"
#include "apps/paper/stepper.hpp"
#include "apps/paper/variant.hpp"

namespace throng::paper {

// Section 4: the grid is shaped once, and filled and searched in every step.
template <class Device>
class GridSearch final : public Stepper {
 public:
  explicit GridSearch(const Job& job)
      : device_(job.threads),
        variant_(job.variant),
        n_(job.n),
        memory_bytes_(job.memory_bytes),
        shape_(make_grid(job.environment, job.n, job.variant.per_cell)),
        cells_(shape_.cell_count()),
        pairs_(n_) {
    require_memory((cells_ + 1) * (sizeof(std::uint32_t) + sizeof(std::uint64_t)), memory_bytes_,
                   "the table of " + std::to_string(cells_) + " cells",
                   "give --grid a larger X, or allow more by --memory");
    boxes_.reserve(n_);
    counts_.reserve(cells_ + 1);
    starts_.reserve(cells_ + 1);
    step_.cells = cells_;
  }

  const Step& step(const Box* given) override {
    device_.hold(given, n_);
    device_.restart();
    const Box* boxes = device_.upload(given, n_);
    device_.mark();
    device_.each(n_, CopyBox{boxes, boxes_.data()});
    device_.mark();
    update();
    device_.mark();
    with_mapping(variant_, nullptr, [&](const auto& mapping) { search(mapping); });
    device_.mark();
    const Pair* pairs = pairs_.fetch(device_);
    device_.mark();
    device_.finish();
    step_.pairs.assign(pairs, pairs + pairs_.count());
    step_.output_bytes = pairs_.count() * sizeof(Pair);
    Times& times = step_.times;
    times.upload = device_.ms(0);
    times.boxes = device_.ms(1);
    times.grid = device_.ms(2);
    times.search = device_.ms(3);
    times.download = device_.ms(4);
    return step_;
  }

 private:
  // Count, scan, fill: the lists are contiguous and exactly as long as needed. One count more than
  // there are cells, always 0: its prefix sum is the number of all entries.
  void update() {
    device_.zero(counts_, cells_ + 1);
    device_.each(n_, CountEntries{shape_, boxes_.data(), counts_.data()});
    device_.scan(counts_.data(), starts_.data(), cells_ + 1);
    step_.entries = device_.read(starts_.data() + cells_);
    require_memory(step_.entries * sizeof(std::uint32_t), memory_bytes_,
                   "the lists of " + std::to_string(step_.entries) + " entries of boxes in cells",
                   "give --grid a larger X, or allow more by --memory");
    entries_.reserve(step_.entries);
    device_.each(
        n_, FillEntries{shape_, boxes_.data(), starts_.data(), counts_.data(), entries_.data()});
  }

  template <class Mapping>
  void search(const Mapping& mapping) {
    pairs_.collect(device_, [&](const PairSink& sink) {
      device_.teams(cells_, SearchCell<Mapping>{shape_, boxes_.data(), starts_.data(),
                                                entries_.data(), mapping, sink});
    });
  }

  Device device_;
  Variant variant_;
  std::uint64_t n_, memory_bytes_;
  GridShape shape_;
  std::uint64_t cells_;
  typename Device::template Array<Box> boxes_;
  typename Device::template Array<std::uint32_t> counts_, entries_;
  typename Device::template Array<std::uint64_t> starts_;
  PairList<Device> pairs_;
  Step step_;
};

}  // namespace throng::paper
