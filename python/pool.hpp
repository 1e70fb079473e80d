// Threads of the module's own: a wheel brings them along, and they wait for the next search.
#pragma once

#include <condition_variable>
#include <mutex>

#include <throng/options.hpp>

namespace throng::python {

// There is one for the whole process. Its threads start when they are first needed and end with
// the process; they never touch Python but in a consumer, which takes the interpreter's lock.
class Pool {
 public:
  // Executor::run, of executor().
  void run(unsigned count, void (*task)(void* context, unsigned index), void* context);
  // body(context) on one of the threads, while the caller calls poll(poll_context) every 30 ms.
  // False where no thread can be started: nothing was called.
  bool run_aside(void (*body)(void* context), void* context, void (*poll)(void* context),
                 void* poll_context);

 private:
  struct Job;
  bool start(unsigned threads);  // under the lock; true where there is a thread
  void append(Job& job) noexcept;
  void take_one(Job& job, std::unique_lock<std::mutex>& lock);
  void work();

  std::mutex mutex_;
  std::condition_variable wake_;
  Job* first_ = nullptr;  // jobs with tasks that nobody has taken
  Job* last_ = nullptr;
  unsigned threads_ = 0;
};

Pool& pool();
// An executor on that pool, with a task for each processor that this process may use.
const Executor& executor();
// After a fork the child has none of the threads: it begins with a new pool.
void forget_threads();

}  // namespace throng::python
