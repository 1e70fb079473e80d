// Where pairs end up: a buffer, a consumer, or one range of the canonical order.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>

#include <throng/finder.hpp>
#include <throng/types.hpp>

#include "cpu/emit.hpp"
#include "cpu/threads.hpp"

namespace throng::cpu {

// Room in the output, [begin, end).
struct Room {
  Pair* begin;
  Pair* end;
  std::size_t size() const noexcept { return static_cast<std::size_t>(end - begin); }
};

class Sink {
 public:
  virtual ~Sink() = default;
  // Takes `count` pairs, from any thread.
  virtual void take(const Pair* pairs, std::size_t count) = 0;
  // Room to be written without a copy, from any thread. `room` is the end of what the caller has:
  // it grows where what follows is free, else it becomes room elsewhere. False where there is none;
  // pairs are to be taken then.
  virtual bool extend(Room&) { return false; }
  // Room that stays empty. One thread at a time.
  virtual void leave(Room) noexcept {}
  // True where nobody wants more.
  virtual bool stopped() const noexcept { return false; }
};

// Counts always, writes while there is room. Workers write into pieces of the output; what they
// leave empty is filled from the end by close(). As the output may then be full before all of its
// pieces are, it goes on in some room of the sink's own, the spill.
class BufferSink final : public Sink {
 public:
  // So much room a spill needs: what workers leave empty at most. One alone fills what it has.
  static constexpr std::size_t spill_for(unsigned workers, std::size_t capacity) noexcept {
    return workers == 1 ? 0 : std::min<std::size_t>(capacity, workers * most_empty);
  }

  // The rooms are filled by leave().
  // cppcheck-suppress uninitMemberVar
  BufferSink(Pair* out, std::size_t capacity, Pair* spill, std::size_t spill_capacity) noexcept
      : out_(out), capacity_(capacity), spill_(spill), end_(capacity + spill_capacity) {}
  void take(const Pair* pairs, std::size_t count) override;
  bool extend(Room& room) override;
  void leave(Room room) noexcept override;
  // To be called once, when all pairs are there: the first written() of the output are pairs then.
  void close() noexcept;
  std::uint64_t found() const noexcept { return next_ - empty_; }
  std::uint64_t written() const noexcept { return found() < capacity_ ? found() : capacity_; }

 private:
  static constexpr std::size_t most_rooms = 2 * max_workers;
  // A piece of the output: large enough that few are asked for, and less where little is left, so
  // that no worker sits on what another needs.
  static constexpr std::uint64_t most_pairs = 4096, least_pairs = 512;
  // Of a worker: a room that grew when it was full but for its slack, and a gap of as much.
  static constexpr std::uint64_t most_empty = most_pairs + 2 * emit_slack;
  // Counts of pairs cannot overflow. Two sets have at most m^2 pairs, m = max_box_count < 2^32 - 1,
  // one set fewer; so there are less than 2^64 - 2^33. next_ counts beside them what was left
  // empty.
  static_assert(max_box_count * max_box_count < ~std::uint64_t{0} - max_workers * most_empty);

  // Of the output and what it goes on in.
  Pair& at(std::uint64_t i) const noexcept {
    return i < capacity_ ? out_[i] : spill_[i - capacity_];
  }

  Pair* out_;
  std::uint64_t capacity_;
  Pair* spill_;
  std::uint64_t end_;                   // of the spill
  std::atomic<std::uint64_t> next_{0};  // what lies before is given away
  std::uint64_t empty_ = 0;
  std::size_t room_count_ = 0;
  Room rooms_[most_rooms];
};

// Hands blocks on as they come.
class ConsumerSink final : public Sink {
 public:
  ConsumerSink(const Consumer& consumer, bool concurrent) noexcept
      : consumer_(consumer), concurrent_(concurrent) {}
  void take(const Pair* pairs, std::size_t count) override;
  bool stopped() const noexcept override { return stopped_.load(std::memory_order_relaxed); }
  // Throws what the consumer threw.
  void finish();
  std::uint64_t found() const noexcept { return found_.load(std::memory_order_relaxed); }
  std::uint64_t delivered() const noexcept { return delivered_.load(std::memory_order_relaxed); }

 private:
  void call(const Pair* pairs, std::size_t count);

  const Consumer& consumer_;
  bool concurrent_;
  std::atomic<bool> stopped_{false};
  std::atomic<std::uint64_t> found_{0}, delivered_{0};
  std::mutex mutex_;
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
  std::mutex mutex_;
  std::uint64_t histogram_[slices] = {};
};

}  // namespace throng::cpu
