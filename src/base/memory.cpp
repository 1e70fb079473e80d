#include "base/memory.hpp"

#include <new>

namespace throng::base {

void* Memory::take(std::size_t bytes, std::size_t alignment) {
  const std::lock_guard<Mutex> lock(mutex_);
  if (cap_ != 0 && (bytes > cap_ || held_ > cap_ - bytes)) {
    // Saturating sum.
    throw CapExceeded{bytes > static_cast<std::size_t>(-1) - held_ ? static_cast<std::size_t>(-1)
                                                                   : held_ + bytes};
  }
  void* p = nullptr;
  try {
    p = upstream_->allocate(bytes, alignment);
  } catch (...) {
    p = nullptr;
  }
  if (!p) throw AllocationFailed{bytes};
  held_ += bytes;
  return p;
}

void Memory::give(void* p, std::size_t bytes, std::size_t alignment) noexcept {
  const std::lock_guard<Mutex> lock(mutex_);
  upstream_->deallocate(p, bytes, alignment);
  held_ -= bytes;
}

}  // namespace throng::base
