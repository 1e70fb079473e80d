#include "support/guarded_memory.hpp"

#include <new>

#ifdef _WIN32
#include <windows.h>
#else
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace throng::tests {
namespace {

#ifdef _WIN32

std::size_t page_bytes() {
  SYSTEM_INFO info;
  GetSystemInfo(&info);
  return info.dwPageSize;
}
char* map(std::size_t bytes) {
  return static_cast<char*>(VirtualAlloc(nullptr, bytes, MEM_RESERVE | MEM_COMMIT, PAGE_READWRITE));
}
bool protect(char* page, std::size_t bytes) {
  DWORD before = 0;
  return VirtualProtect(page, bytes, PAGE_NOACCESS, &before) != 0;
}
void unmap(char* base, std::size_t) { VirtualFree(base, 0, MEM_RELEASE); }

#else

std::size_t page_bytes() { return static_cast<std::size_t>(sysconf(_SC_PAGESIZE)); }
char* map(std::size_t bytes) {
  void* p = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return p == MAP_FAILED ? nullptr : static_cast<char*>(p);
}
bool protect(char* page, std::size_t bytes) { return mprotect(page, bytes, PROT_NONE) == 0; }
void unmap(char* base, std::size_t bytes) { munmap(base, bytes); }

#endif

}  // namespace

GuardedMemory::GuardedMemory(std::size_t bytes) {
  const std::size_t page = page_bytes();
  whole_ = (bytes + page - 1) / page * page + page;
  base_ = map(whole_);
  if (!base_) throw std::bad_alloc();
  if (!protect(base_ + whole_ - page, page)) throw std::bad_alloc();
  begin_ = base_ + whole_ - page - bytes;
}

GuardedMemory::~GuardedMemory() { unmap(base_, whole_); }

}  // namespace throng::tests
