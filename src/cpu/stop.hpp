// Whether a call is to stop. Once a task has seen that, all do, and the call is told so, even if
// its caller takes it back meanwhile: what broke off must not pass for whole.
#pragma once

#include <atomic>

namespace throng::cpu {

class Stop {
 public:
  explicit Stop(const std::atomic<bool>* asked) noexcept : asked_(asked) {}

  // From any task.
  bool operator()() noexcept {
    if (!asked_ || !asked_->load(std::memory_order_relaxed)) return seen();
    seen_.store(true, std::memory_order_relaxed);
    return true;
  }
  bool seen() const noexcept { return seen_.load(std::memory_order_relaxed); }

 private:
  const std::atomic<bool>* asked_;
  std::atomic<bool> seen_{false};
};

}  // namespace throng::cpu
