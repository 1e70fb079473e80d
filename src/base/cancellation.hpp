// Cancellation of a call. Once a task has seen the request all tasks do, and the call reports it,
// even if the caller withdraws it meanwhile: a partial result must not pass for a complete one.
#pragma once

#include <atomic>

namespace throng::base {

class Cancellation {
 public:
  explicit Cancellation(const std::atomic<bool>* requested) noexcept : requested_(requested) {}

  // Callable from any task.
  bool operator()() noexcept {
    if (!requested_ || !requested_->load(std::memory_order_relaxed)) return seen();
    seen_.store(true, std::memory_order_relaxed);
    return true;
  }
  bool seen() const noexcept { return seen_.load(std::memory_order_relaxed); }

 private:
  const std::atomic<bool>* requested_;
  std::atomic<bool> seen_{false};
};

}  // namespace throng::base
