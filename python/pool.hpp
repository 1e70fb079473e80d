// The module's thread pool: part of the wheel; its threads wait for the next search.
#pragma once

#include <condition_variable>
#include <mutex>

#include <throng/options.hpp>

namespace throng::python {

// One pool per process. Its threads start on demand and end with the process; they call Python only
// in a consumer, which takes the interpreter's lock.
class Pool {
 public:
  // Executor::run, of executor().
  void run(unsigned count, void (*task)(void* context, unsigned index), void* context);
  // body(context) on one of the threads, while the caller calls poll(poll_context) every 30 ms.
  // False if no thread can be started: nothing was called.
  bool run_in_background(void (*body)(void* context), void* context, void (*poll)(void* context),
                         void* poll_context);

 private:
  struct Job;
  bool start(unsigned threads);  // under the lock; true if there is a thread
  void append(Job& job) noexcept;
  void run_one_task(Job& job, std::unique_lock<std::mutex>& lock);
  void work();

  std::mutex mutex_;
  std::condition_variable wake_;
  Job* first_ = nullptr;  // jobs with unclaimed tasks
  Job* last_ = nullptr;
  unsigned threads_ = 0;
};

Pool& pool();
// An executor on that pool, with a task for each processor that this process may use.
const Executor& executor();
// A forked child has none of the threads: it starts with a new pool.
void forget_threads();

}  // namespace throng::python
