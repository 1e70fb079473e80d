// Who is inside: one who may change things, or any number of those who look.
#pragma once

#include <atomic>

namespace throng {

// Nobody waits: who may not come in is told so. Those who look count themselves in and then ask
// whether somebody is alone; who wants to be alone says so and then asks whether any are in. In one
// order for all, so that one of two sees the other.
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

  // `who`: a number of one's own. Those of different places share no cache line.
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
  std::atomic<bool> used_{false};  // somebody has looked
  Place places_[place_count];
};

}  // namespace throng
