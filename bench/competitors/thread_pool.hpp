// A few threads that wait for work: they spin briefly, then sleep. For the baseline grids, whose
// passes take a few microseconds at small n.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace throng::bench {

class ThreadPool {
 public:
  explicit ThreadPool(unsigned threads) : size_(threads ? threads : 1) {
    for (unsigned t = 1; t < size_; ++t) threads_.emplace_back([this, t] { serve(t); });
  }
  ~ThreadPool() {
    job_ = nullptr;
    generation_.fetch_add(1, std::memory_order_release);
    generation_.notify_all();
    for (auto& t : threads_) t.join();
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  unsigned size() const { return size_; }

  // Runs job(t) on every thread t; returns when all have returned.
  void run(const std::function<void(unsigned)>& job) {
    if (size_ == 1) return job(0);
    job_ = &job;
    left_.store(size_ - 1, std::memory_order_relaxed);
    generation_.fetch_add(1, std::memory_order_release);
    generation_.notify_all();
    job(0);
    for (int spin = 0; spin < 20000 && left_.load(std::memory_order_acquire) != 0; ++spin) pause();
    for (unsigned left; (left = left_.load(std::memory_order_acquire)) != 0;) left_.wait(left);
  }

  // The begin of the t-th of `size` nearly equal parts of 0..count-1.
  static std::size_t part(std::size_t count, unsigned t, unsigned size) { return count * t / size; }

 private:
  static void pause() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  void serve(unsigned t) {
    std::uint32_t seen = 0;
    for (;;) {
      for (int spin = 0; spin < 1000; ++spin) {
        if (generation_.load(std::memory_order_acquire) != seen) break;
        pause();
      }
      generation_.wait(seen, std::memory_order_acquire);
      ++seen;
      if (!job_) return;
      (*job_)(t);
      if (left_.fetch_sub(1, std::memory_order_release) == 1) left_.notify_one();
    }
  }

  unsigned size_;
  std::atomic<std::uint32_t> generation_{0};
  std::atomic<unsigned> left_{0};
  const std::function<void(unsigned)>* job_ = nullptr;
  std::vector<std::thread> threads_;
};

}  // namespace throng::bench
