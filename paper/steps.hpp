// The paper's system on any device: which functions are launched, in which order, on which memory.
// Device is HostDevice (host.hpp) or the CUDA one (cuda.cu).
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "core/pair_index.hpp"
#include "paper/failure.hpp"
#include "paper/grid.hpp"
#include "paper/matrix.hpp"
#include "paper/search.hpp"
#include "paper/stepper.hpp"
#include "paper/variant.hpp"

namespace throng::paper {

// Room for pairs that grows until all are in.
template <class Device>
class PairList {
 public:
  explicit PairList(std::uint64_t n) : first_capacity_(4 * n + 1024) {}

  // launch(sink) tells each pair to the sink. If there are more of them than there is room, they
  // are told once more into larger room: none is lost, and nothing is written past the end.
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

// Sections 3.1 to 3.4: one thread a pair, over all pairs.
template <class Device>
class BruteForce final : public Stepper {
 public:
  explicit BruteForce(const Job& job)
      : device_(job.threads),
        variant_(job.variant),
        n_(job.n),
        places_(thread_count(variant_, n_)),
        pairs_(n_) {
    boxes_.reserve(n_);
    const bool bits = variant_.output == Output::bit;
    if (variant_.output != Output::pairs) {
      require_memory(
          bits ? word_count(places_) * 4 : places_, job.memory_bytes,
          std::string("the matrix of one ") + name(variant_.output) + " a pair",
          bits ? "use --output pairs or --grid X, or allow more by --memory"
               : "use --output bit, --output pairs or --grid X, or allow more by --memory");
      if (bits) words_.reserve(word_count(places_));
      if (!bits) bytes_.reserve(places_);
    }
    if (variant_.mapping == MappingKind::stored) {
      require_memory(places_ * sizeof(Pair), job.memory_bytes, "the stored list of pairs",
                     "use --mapping formula, or allow more by --memory");
      list_.reserve(places_);
      device_.each(places_, FillList<Exact>{Exact{}, n_, list_.data()});
    }
  }

  const Step& step(const Box* given) override {
    device_.hold(given, n_);
    device_.restart();
    const Box* boxes = device_.upload(given, n_);
    device_.mark();
    device_.each(n_, TakeBox{boxes, boxes_.data()});
    device_.mark();
    with_mapping(variant_, list_.data(), [&](const auto& mapping) { search(mapping); });
    device_.mark();
    fetch();
    device_.mark();
    device_.finish();
    Times& times = step_.times;
    times.upload = device_.ms(0);
    times.boxes = device_.ms(1);
    times.search = device_.ms(2);
    times.download = device_.ms(3);
    decode();
    return step_;
  }

 private:
  template <class Mapping>
  void search(const Mapping& mapping) {
    using Tested = PairTest<Mapping>;
    const Tested test{mapping, boxes_.data(), n_};
    if (variant_.output == Output::byte) {
      device_.each(places_, WriteByte<Tested>{test, bytes_.data()});
    } else if (variant_.output == Output::pairs) {
      pairs_.collect(device_, [&](const PairSink& sink) {
        device_.each(places_, WritePair<Tested>{test, sink});
      });
    } else if (variant_.write == Write::ballot) {
      device_.ballots(places_, test, words_.data());
    } else if (variant_.write == Write::owned) {
      device_.each(word_count(places_), WriteWord<Tested>{test, words_.data(), places_});
    } else {  // these set bits and clear none
      device_.zero(words_, word_count(places_));
      if (variant_.write == Write::atomic) {
        device_.each(places_, WriteBitAtomic<Tested>{test, words_.data()});
      } else {
        device_.in_step(places_,
                        WriteBitRacy<Tested>{test, reinterpret_cast<std::uint8_t*>(words_.data())});
      }
    }
  }

  void fetch() {
    switch (variant_.output) {
      case Output::bit:
        fetched_ = device_.fetch(words_, word_count(places_));
        step_.output_bytes = byte_count(places_);
        break;
      case Output::byte:
        fetched_ = device_.fetch(bytes_, places_);
        step_.output_bytes = places_;
        break;
      case Output::pairs:
        fetched_ = pairs_.fetch(device_);
        step_.output_bytes = pairs_.count() * sizeof(Pair);
        break;
    }
  }

  // On the host, from what was fetched.
  void decode() {
    const auto start = std::chrono::steady_clock::now();
    step_.pairs.clear();
    const auto found = [&](std::uint64_t place) {
      Pair pair{};
      if (pair_of_place(variant_, place, n_, pair)) step_.pairs.push_back(pair);
    };
    if (variant_.output == Output::bit) {
      for_each_bit(static_cast<const std::uint32_t*>(fetched_), places_, found);
    } else if (variant_.output == Output::byte) {
      for_each_byte(static_cast<const std::uint8_t*>(fetched_), places_, found);
    } else {
      const Pair* pairs = static_cast<const Pair*>(fetched_);
      step_.pairs.assign(pairs, pairs + pairs_.count());
    }
    step_.times.decode =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }

  Device device_;
  Variant variant_;
  std::uint64_t n_, places_;
  typename Device::template Array<Box> boxes_;
  typename Device::template Array<std::uint32_t> words_;
  typename Device::template Array<std::uint8_t> bytes_;
  typename Device::template Array<Pair> list_;
  PairList<Device> pairs_;
  const void* fetched_ = nullptr;
  Step step_;
};

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
    device_.each(n_, TakeBox{boxes, boxes_.data()});
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
  // Count, scan, fill: the lists lie one after another and are as long as they must be. One count
  // more than there are cells, always 0: its sum is the number of all entries.
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

template <class Device>
std::unique_ptr<Stepper> make_stepper(const Job& job) {
  if (job.n > max_objects) {
    throw Failure("found " + std::to_string(job.n) + " objects, and the radicand of the mapping " +
                  "formula overflows 63 bits beyond " + std::to_string(max_objects) +
                  "; split the set");
  }
  if (job.variant.per_cell > 0) {
    if (job.variant.mapping == MappingKind::stored) {
      throw Failure(
          "the stored list holds the pairs of all n objects, and a cell of the grid has " +
          std::string("a list of its own length; use another --mapping with --grid"));
    }
    return std::make_unique<GridSearch<Device>>(job);
  }
  return std::make_unique<BruteForce<Device>>(job);
}

}  // namespace throng::paper
