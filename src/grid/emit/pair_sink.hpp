// Pair destinations: a buffer, a consumer, or one range of the sorted order.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>

#include <throng/finder.hpp>
#include <throng/types.hpp>

#include "base/mutex.hpp"
#include "base/threads.hpp"
#include "grid/emit/pair_output.hpp"

namespace throng::grid {

// A free range of the output, [begin, end).
struct OutputRange {
  Pair* begin;
  Pair* end;
  std::size_t size() const noexcept { return static_cast<std::size_t>(end - begin); }
};

class Sink {
 public:
  virtual ~Sink() = default;
  // Receives `count` pairs, from any thread.
  virtual void take(const Pair* pairs, std::size_t count) = 0;
  // Extends a range for writing in place, from any thread. On input it is the rest of the caller's
  // range: it grows if the space after it is free, else it becomes another range. Returns false if
  // there is none; the caller then uses take().
  virtual bool extend(OutputRange&) { return false; }
  // Returns a range that stays empty. One thread at a time.
  virtual void leave(OutputRange) noexcept {}
  // True if no more pairs are wanted.
  virtual bool stopped() const noexcept { return false; }
};

// Counts all pairs, writes those that fit. Workers write into ranges of the output; close() fills
// what they leave empty with pairs from the end. The output may fill up before all its ranges do,
// so it continues in a spill buffer.
class BufferSink final : public Sink {
 public:
  // Size of the spill buffer: at most what workers leave empty. A single worker fills its range.
  static constexpr std::size_t spill_for(unsigned workers, std::size_t capacity) noexcept {
    return workers == 1 ? 0 : std::min<std::size_t>(capacity, workers * max_empty);
  }

  // leave() fills ranges_.
  // cppcheck-suppress uninitMemberVar
  BufferSink(Pair* out, std::size_t capacity, Pair* spill, std::size_t spill_capacity) noexcept
      : out_(out), capacity_(capacity), spill_(spill), end_(capacity + spill_capacity) {}
  void take(const Pair* pairs, std::size_t count) override;
  bool extend(OutputRange& range) override;
  void leave(OutputRange range) noexcept override;
  // Call once, after all pairs are found; then the first written() entries of the output are pairs.
  void close() noexcept;
  std::uint64_t found() const noexcept { return next_ - empty_; }
  std::uint64_t written() const noexcept { return found() < capacity_ ? found() : capacity_; }

 private:
  static constexpr std::size_t max_ranges = 2 * base::max_workers;
  // Size of a range: large, for few requests; smaller near the end, so that no worker holds what
  // another needs.
  static constexpr std::uint64_t max_range_pairs = 4096, min_range_pairs = 512;
  // Per worker: a range that grew when it was full but for its slack, and a gap of the same size.
  static constexpr std::uint64_t max_empty = max_range_pairs + 2 * PairOutput::slack;
  // Counts of pairs cannot overflow. Two sets have at most m^2 pairs, m = max_box_count < 2^32 - 1,
  // one set fewer; so there are less than 2^64 - 2^33. next_ also counts the entries left empty.
  static_assert(max_box_count * max_box_count < ~std::uint64_t{0} - base::max_workers * max_empty);

  // Entry i of the output, which continues in the spill.
  Pair& at(std::uint64_t i) const noexcept {
    return i < capacity_ ? out_[i] : spill_[i - capacity_];
  }

  Pair* out_;
  std::uint64_t capacity_;
  Pair* spill_;
  std::uint64_t end_;                   // of the spill
  std::atomic<std::uint64_t> next_{0};  // everything before it is assigned
  std::uint64_t empty_ = 0;
  std::size_t range_count_ = 0;
  OutputRange ranges_[max_ranges];
};

// Passes blocks of pairs to the consumer as they come.
class ConsumerSink final : public Sink {
 public:
  ConsumerSink(const Consumer& consumer, bool concurrent) noexcept
      : consumer_(consumer), concurrent_(concurrent) {}
  void take(const Pair* pairs, std::size_t count) override;
  bool stopped() const noexcept override { return stopped_.load(std::memory_order_relaxed); }
  // Rethrows the consumer's exception.
  void finish();
  std::uint64_t found() const noexcept { return found_.load(std::memory_order_relaxed); }
  std::uint64_t delivered() const noexcept { return delivered_.load(std::memory_order_relaxed); }

 private:
  void call(const Pair* pairs, std::size_t count);

  const Consumer& consumer_;
  bool concurrent_;
  std::atomic<bool> stopped_{false};
  std::atomic<std::uint64_t> found_{0}, delivered_{0};
  base::Mutex mutex_;
  std::exception_ptr thrown_;
};

// Keeps the pairs whose key, first << 32 | second, lies in slice_count slices of 2^slice_bits keys
// from `begin` on, and counts them by slice.
class RangeSink final : public Sink {
 public:
  static constexpr std::size_t slices = 4096;
  RangeSink(std::uint64_t begin, unsigned slice_bits, Pair* out, std::size_t capacity,
            std::size_t slice_count = slices) noexcept;
  void take(const Pair* pairs, std::size_t count) override;
  std::uint64_t found() const noexcept { return found_.load(std::memory_order_relaxed); }
  std::uint64_t in_slice(std::size_t s) const noexcept { return histogram_[s]; }

 private:
  std::uint64_t begin_;
  unsigned slice_bits_;
  std::size_t slice_count_;
  Pair* out_;
  std::uint64_t capacity_;
  std::atomic<std::uint64_t> found_{0};
  base::Mutex mutex_;
  std::uint64_t histogram_[slices] = {};
};

}  // namespace throng::grid
