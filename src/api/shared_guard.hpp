// A non-blocking guard: one writer or any number of readers.
#pragma once

#include <atomic>

namespace throng {

// Non-blocking: a conflicting try_lock_shared fails instead of waiting. A reader increments its
// counter, then checks for a writer; a writer sets its flag, then checks the counters. Sequential
// consistency guarantees that at least one of the two sees the other.
class SharedGuard {
 public:
  bool try_lock() noexcept {
    if (writer_.exchange(true, std::memory_order_seq_cst)) return false;
    if (!ever_read_.load(std::memory_order_seq_cst)) return true;
    for (const Slot& slot : slots_) {
      if (slot.readers.load(std::memory_order_seq_cst) == 0) continue;
      unlock();
      return false;
    }
    return true;
  }
  void unlock() noexcept { writer_.store(false, std::memory_order_release); }

  // `reader`: an index of the reader, e.g. per thread. Different slots lie on different cache
  // lines.
  bool try_lock_shared(unsigned reader) noexcept {
    if (!ever_read_.load(std::memory_order_seq_cst))
      ever_read_.store(true, std::memory_order_seq_cst);
    slots_[reader % slot_count].readers.fetch_add(1, std::memory_order_seq_cst);
    if (!writer_.load(std::memory_order_seq_cst)) return true;
    unlock_shared(reader);
    return false;
  }
  void unlock_shared(unsigned reader) noexcept {
    slots_[reader % slot_count].readers.fetch_sub(1, std::memory_order_release);
  }

 private:
  static constexpr unsigned slot_count = 16;
  struct alignas(64) Slot {
    std::atomic<unsigned> readers{0};
  };
  alignas(64) std::atomic<bool> writer_{false};
  std::atomic<bool> ever_read_{false};  // a reader has ever entered
  Slot slots_[slot_count];
};

}  // namespace throng
