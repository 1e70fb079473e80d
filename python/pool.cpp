#include "python/pool.hpp"

#include <atomic>
#include <chrono>
#include <system_error>
#include <thread>

namespace throng::python {
namespace {

unsigned processors() noexcept {
  const unsigned n = std::thread::hardware_concurrency();
  return n > 0 ? n : 1u;
}

// Never freed: its threads may outlive all static destructors.
std::atomic<Pool*> global_pool{nullptr};

}  // namespace

// On the stack of the waiting caller; accessed under the lock, except task and context.
struct Pool::Job {
  void (*task)(void*, unsigned);
  void* context;
  unsigned count;
  unsigned next = 0;
  unsigned done = 0;
  std::condition_variable ended{};
  Job* later = nullptr;
};

bool Pool::start(unsigned threads) {
  const unsigned wanted = threads < processors() ? threads : processors();
  while (threads_ < wanted) {
    try {
      std::thread([this] { work(); }).detach();
    } catch (const std::system_error&) {
      break;  // the existing threads and the caller do the work
    }
    ++threads_;
  }
  return threads_ > 0;
}

void Pool::append(Job& job) noexcept {
  if (last_)
    last_->later = &job;
  else
    first_ = &job;
  last_ = &job;
}

// Runs one task of the job, which has one left. The job may be destroyed when this returns to a
// worker.
void Pool::run_one_task(Job& job, std::unique_lock<std::mutex>& lock) {
  const unsigned index = job.next++;
  if (job.next == job.count) {
    Job** link = &first_;
    Job* before = nullptr;
    while (*link != &job) {
      before = *link;
      link = &before->later;
    }
    *link = job.later;
    if (last_ == &job) last_ = before;
  }
  lock.unlock();
  job.task(job.context, index);
  lock.lock();
  if (++job.done == job.count) job.ended.notify_all();
}

void Pool::work() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return first_ != nullptr; });
    run_one_task(*first_, lock);
  }
}

void Pool::run(unsigned count, void (*task)(void*, unsigned), void* context) {
  if (count == 0) return;
  Job job{task, context, count};
  std::unique_lock<std::mutex> lock(mutex_);
  // The caller works too, so that this ends even if all threads are busy with other searches.
  start(count - 1);
  append(job);
  for (unsigned i = 1; i < count; ++i) wake_.notify_one();
  while (job.next < job.count) run_one_task(job, lock);
  job.ended.wait(lock, [&] { return job.done == job.count; });
}

bool Pool::run_in_background(void (*body)(void*), void* context, void (*poll)(void*),
                             void* poll_context) {
  struct BackgroundCall {
    void (*body)(void*);
    void* context;
  } aside{body, context};
  Job job{[](void* a, unsigned) {
            static_cast<BackgroundCall*>(a)->body(static_cast<BackgroundCall*>(a)->context);
          },
          &aside, 1};
  std::unique_lock<std::mutex> lock(mutex_);
  // One thread more than the search can use, as its caller only waits.
  if (!start(processors())) return false;
  append(job);
  wake_.notify_one();
  while (!job.ended.wait_for(lock, std::chrono::milliseconds(30), [&] { return job.done == 1; })) {
    lock.unlock();
    poll(poll_context);
    lock.lock();
  }
  return true;
}

Pool& pool() {
  Pool* p = global_pool.load(std::memory_order_acquire);
  if (p) return *p;
  auto* fresh = new Pool;
  if (global_pool.compare_exchange_strong(p, fresh)) return *fresh;
  delete fresh;
  return *p;
}

const Executor& executor() {
  static const Executor on_pool{processors(),
                                [](void*, unsigned count, void (*task)(void*, unsigned),
                                   void* context) { pool().run(count, task, context); },
                                nullptr};
  return on_pool;
}

void forget_threads() { global_pool.store(nullptr); }

}  // namespace throng::python
