// Parts of <atomic> that the library uses, also where the standard library lacks them: libc++ has
// std::atomic_ref since 19, and sums of floating-point numbers since 18.
#pragma once

#include <atomic>

namespace throng::base {

#ifdef __cpp_lib_atomic_ref

template <class T>
using AtomicRef = std::atomic_ref<T>;

#else

template <class T>
class AtomicRef {
 public:
  explicit AtomicRef(T& object) noexcept : object_(&object) {}
  T load(std::memory_order order) const noexcept {
    return __atomic_load_n(object_, static_cast<int>(order));
  }
  void store(T value, std::memory_order order) const noexcept {
    __atomic_store_n(object_, value, static_cast<int>(order));
  }
  T fetch_add(T value, std::memory_order order) const noexcept {
    return __atomic_fetch_add(object_, value, static_cast<int>(order));
  }
  T fetch_or(T value, std::memory_order order) const noexcept {
    return __atomic_fetch_or(object_, value, static_cast<int>(order));
  }
  bool compare_exchange_weak(T& expected, T value, std::memory_order order) const noexcept {
    return __atomic_compare_exchange_n(object_, &expected, value, true, static_cast<int>(order),
                                       __ATOMIC_RELAXED);
  }

 private:
  T* object_;
};

#endif

// Relaxed. Returns the new sum.
inline double add(std::atomic<double>& sum, double value) noexcept {
  double before = sum.load(std::memory_order_relaxed);
  while (!sum.compare_exchange_weak(before, before + value, std::memory_order_relaxed)) {
  }
  return before + value;
}

}  // namespace throng::base
