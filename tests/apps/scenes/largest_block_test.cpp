// The operators, in a file without a test: a compiler that sees both sides of a call reports free()
// as a mistake. Defines all forms, because a sanitizer's own do not call one another.
#include "largest_block.hpp"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace {
thread_local std::size_t largest = 0;

void* take(std::size_t bytes) noexcept {
  largest = std::max(largest, bytes);
  return std::malloc(bytes ? bytes : 1);
}
void* allocate_or_throw(std::size_t bytes) {
  if (void* p = take(bytes)) return p;
  throw std::bad_alloc();
}
}  // namespace

void forget_blocks() noexcept { largest = 0; }
std::size_t largest_block() noexcept { return largest; }

void* operator new(std::size_t bytes) { return allocate_or_throw(bytes); }
void* operator new[](std::size_t bytes) { return allocate_or_throw(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return take(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return take(bytes); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
void operator delete[](void* p, const std::nothrow_t&) noexcept { std::free(p); }
