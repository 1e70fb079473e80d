// A memory resource that counts, with an optional limit.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory_resource>
#include <mutex>
#include <new>

#include "support/aligned_memory.hpp"

namespace throng::tests {

class CountingResource : public std::pmr::memory_resource {
 public:
  std::size_t held() const { return held_; }
  std::size_t peak() const { return peak_; }
  std::size_t allocations() const { return allocations_; }
  // Refuses requests that would raise held() above `bytes`.
  void limit(std::size_t bytes) { limit_ = bytes; }

 protected:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (bytes > limit_ || held_ > limit_ - bytes) throw std::bad_alloc();
    void* memory = allocate_aligned(bytes, alignment);
    if (!memory) throw std::bad_alloc();
    held_ += bytes;
    peak_ = std::max(peak_, held_);
    ++allocations_;
    return memory;
  }
  void do_deallocate(void* memory, std::size_t bytes, std::size_t) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_ -= bytes;
    free_aligned(memory);
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }

 private:
  std::mutex mutex_;
  std::size_t held_ = 0, peak_ = 0, allocations_ = 0;
  std::size_t limit_ = std::numeric_limits<std::size_t>::max();
};

}  // namespace throng::tests
