// Memory that is counted, capped, and taken only from the caller's resource.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>

#include <throng/memory_resource.hpp>

#include "base/mutex.hpp"

namespace throng::base {

// Thrown inside the library only; the API layer turns them into a Status.
// Sizes are 64-bit: a request may exceed a 32-bit address space.
struct AllocationFailed {
  std::uint64_t bytes;  // size of the failed request
};
struct CapExceeded {
  std::uint64_t bytes_needed;  // the cap that would have let this request through
};

// Counts what is held and serializes calls to the upstream resource, which need not be thread-safe.
// An upstream that returns null instead of throwing is treated as out of memory.
class Memory {
 public:
  // `already_held`: bytes of the owning object, which count too.
  Memory(std::pmr::memory_resource* upstream, std::size_t already_held) noexcept
      : upstream_(upstream), held_(already_held) {}

  void* take(std::size_t bytes, std::size_t alignment);
  void give(void* p, std::size_t bytes, std::size_t alignment) noexcept;

  template <class T, class... Args>
  T* create(Args&&... args) {
    return new (take(sizeof(T), alignof(T))) T(std::forward<Args>(args)...);
  }
  template <class T>
  void destroy(T* object) noexcept {
    if (!object) return;
    object->~T();
    give(object, sizeof(T), alignof(T));
  }

  std::size_t held() const noexcept { return held_; }
  void set_cap(std::size_t bytes) noexcept { cap_ = bytes; }  // 0: none
  std::size_t cap() const noexcept { return cap_; }

 private:
  std::pmr::memory_resource* upstream_;
  Mutex mutex_;
  std::atomic<std::size_t> held_;  // written under the mutex, read by any thread
  std::size_t cap_ = 0;
};

// An array of trivial values that keeps its capacity. Growing discards its contents.
template <class T>
class Buffer {
 public:
  explicit Buffer(Memory& memory) noexcept : memory_(&memory) {}
  ~Buffer() { release(); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  // Ensures capacity for `count` values, 64-byte aligned. Unless `exact`, adds an eighth, so that
  // frames of slowly growing size do not each reallocate.
  T* ensure(std::size_t count, bool exact = false) {
    if (count > capacity_) {
      release();
      const std::size_t want = exact ? count : count + count / 8;
      data_ = static_cast<T*>(memory_->take(bytes_of(want, count), 64));
      capacity_ = want;
    }
    return data_;
  }
  // The same, keeping the first `keep` values.
  T* grow(std::size_t count, std::size_t keep) {
    if (count > capacity_) {
      const std::size_t want = count + count / 2;
      T* fresh = static_cast<T*>(memory_->take(bytes_of(want, count), 64));
      for (std::size_t i = 0; i < keep; ++i) fresh[i] = data_[i];
      release();
      data_ = fresh;
      capacity_ = want;
    }
    return data_;
  }
  // Grows to the capacity of `other`.
  void match(const Buffer& other) {
    if (other.capacity_ > capacity_) ensure(other.capacity_, true);
  }
  void release() noexcept {
    if (data_) memory_->give(data_, capacity_ * value_bytes, 64);
    data_ = nullptr;
    capacity_ = 0;
  }
  // Both must use the same Memory.
  void swap(Buffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
  }
  T* data() const noexcept { return data_; }
  T& operator[](std::size_t i) const noexcept { return data_[i]; }
  std::size_t capacity() const noexcept { return capacity_; }
  std::size_t bytes() const noexcept { return capacity_ * value_bytes; }

 private:
  // NOLINTNEXTLINE(bugprone-sizeof-expression): T may be a pointer
  static constexpr std::size_t value_bytes = sizeof(T);
  // A count of pairs may be up to 2^64 - 2^33; their bytes then overflow, and no such memory
  // exists. `want` has wrapped if it is below `count`.
  static std::size_t bytes_of(std::size_t want, std::size_t count) {
    constexpr std::size_t most = static_cast<std::size_t>(-1) / value_bytes;
    if (want < count || want > most) throw AllocationFailed{static_cast<std::size_t>(-1)};
    return want * value_bytes;
  }

  Memory* memory_;
  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

}  // namespace throng::base
