// A non-blocking guard: one writer or any number of readers.
#pragma once

#include <atomic>

namespace throng {

// Non-blocking: a conflicting enter fails instead of waiting. A reader increments its counter, then
// checks for a writer; a writer sets its flag, then checks the counters. Sequential consistency
// guarantees that at least one of the two sees the other.
class Gate {
 public:
  bool enter_alone() noexcept {
    if (alone_.exchange(true, std::memory_order_seq_cst)) return false;
    if (!used_.load(std::memory_order_seq_cst)) return true;
    for (const Place& place : places_) {
      if (place.inside.load(std::memory_order_seq_cst) == 0) continue;
      leave_alone();
      return false;
    }
    return true;
  }
  void leave_alone() noexcept { alone_.store(false, std::memory_order_release); }

  // `who`: an index of the reader, e.g. per thread. Different slots lie on different cache lines.
  bool enter(unsigned who) noexcept {
    if (!used_.load(std::memory_order_seq_cst)) used_.store(true, std::memory_order_seq_cst);
    places_[who % place_count].inside.fetch_add(1, std::memory_order_seq_cst);
    if (!alone_.load(std::memory_order_seq_cst)) return true;
    leave(who);
    return false;
  }
  void leave(unsigned who) noexcept {
    places_[who % place_count].inside.fetch_sub(1, std::memory_order_release);
  }

 private:
  static constexpr unsigned place_count = 16;
  struct alignas(64) Place {
    std::atomic<unsigned> inside{0};
  };
  alignas(64) std::atomic<bool> alone_{false};
  std::atomic<bool> used_{false};  // a reader has ever entered
  Place places_[place_count];
};

}  // namespace throng
