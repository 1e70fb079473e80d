// Brute force on any device: the launched functions, their order and their memory.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "apps/paper/matrix.hpp"
#include "apps/paper/pair_list.hpp"
#include "apps/paper/search.hpp"
#include "apps/paper/stepper.hpp"
#include "apps/paper/variant.hpp"

namespace throng::paper {

// Sections 3.1 to 3.4: one thread per pair, over all pairs.
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
    device_.each(n_, CopyBox{boxes, boxes_.data()});
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
    } else {  // they set these bits and clear none
      device_.zero(words_, word_count(places_));
      if (variant_.write == Write::atomic) {
        device_.each(places_, WriteBitAtomic<Tested>{test, words_.data()});
      } else {
        device_.in_lockstep(
            places_, WriteBitRacy<Tested>{test, reinterpret_cast<std::uint8_t*>(words_.data())});
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

  // On the host, from the copied output.
  void decode() {
    const auto start = std::chrono::steady_clock::now();
    step_.pairs.clear();
    const auto found = [&](std::uint64_t place) {
      Pair pair{};
      if (pair_at_position(variant_, place, n_, pair)) step_.pairs.push_back(pair);
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

}  // namespace throng::paper
