// Replaces operator new and, with glibc, malloc and its variants. Link into one program only.
#include "support/heap_count.hpp"

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <new>

#include "support/aligned_memory.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {
namespace {
std::atomic<bool> on{false};
std::atomic<std::size_t> allocations{0};
void count() {
  if (on.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}
}  // namespace

void HeapCount::start() {
  allocations = 0;
  on = true;
}
std::size_t HeapCount::stop() {
  on = false;
  return allocations;
}
bool HeapCount::pause() { return on.exchange(false); }
void HeapCount::resume(bool counting) { on = counting; }

// Sanitizers have their own malloc; there only operator new is counted.
#if defined(__GLIBC__) && !THRONG_SANITIZED
bool HeapCount::complete() { return true; }
}  // namespace throng::tests

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t bytes) noexcept {
  throng::tests::count();
  return __libc_malloc(bytes);
}
void* calloc(std::size_t items, std::size_t bytes) noexcept {
  throng::tests::count();
  return __libc_calloc(items, bytes);
}
void* realloc(void* memory, std::size_t bytes) noexcept {
  throng::tests::count();
  return __libc_realloc(memory, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  throng::tests::count();
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  throng::tests::count();
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) noexcept {
  throng::tests::count();
  *memory = __libc_memalign(alignment, bytes);
  return *memory ? 0 : ENOMEM;
}
}
#else
bool HeapCount::complete() { return false; }
}  // namespace throng::tests

void* operator new(std::size_t bytes) {
  throng::tests::count();
  if (void* memory = std::malloc(bytes ? bytes : 1)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  throng::tests::count();
  if (void* memory = throng::tests::allocate_aligned(bytes, static_cast<std::size_t>(alignment)))
    return memory;
  throw std::bad_alloc();
}
// Required by the standard; sanitizers have their own version, whose memory must not reach free().
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  throng::tests::count();
  return std::malloc(bytes ? bytes : 1);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept {
  throng::tests::free_aligned(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  throng::tests::free_aligned(memory);
}
#endif
