// The locks of the library, and what else needs <thread>. THRONG_THREADS=none builds for a target
// without threads.
#pragma once

#include <mutex>

#if !defined(THRONG_THREADS_NONE)
#include <thread>
#endif

namespace throng::base {

#if defined(THRONG_THREADS_NONE)
// On one thread nobody waits: an owned lock is an error of the caller, which try_lock() reports.
class Mutex {
 public:
  void lock() noexcept { owned_ = true; }
  bool try_lock() noexcept { return !owned_ && (owned_ = true); }
  void unlock() noexcept { owned_ = false; }

 private:
  bool owned_ = false;
};
inline unsigned this_thread_number() noexcept { return 0; }
#else
using Mutex = std::mutex;
// Equal numbers of different threads are possible, but rare.
inline unsigned this_thread_number() noexcept {
  return static_cast<unsigned>(std::hash<std::thread::id>()(std::this_thread::get_id()));
}
#endif

}  // namespace throng::base
