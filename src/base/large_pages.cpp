#include "base/large_pages.hpp"

#include <throng/large_pages.hpp>

#include <cstddef>
#include <cstdint>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace throng {
namespace {

constexpr std::size_t page_bytes = std::size_t{2} << 20;

class LargePages final : public std::pmr::memory_resource {
  // A block's alignment depends on its size, which deallocate receives too.
  static std::align_val_t alignment_of(std::size_t bytes, std::size_t alignment) {
    return std::align_val_t{bytes >= page_bytes && alignment < page_bytes ? page_bytes : alignment};
  }
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    void* block = ::operator new(bytes, alignment_of(bytes, alignment));
    want_large_pages(block, bytes);
    return block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    ::operator delete(block, alignment_of(bytes, alignment));
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }
};

class LargeBlocks final : public std::pmr::memory_resource {
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    void* block = ::operator new (bytes, std::align_val_t{alignment});
    want_large_pages(block, bytes);
    return block;
  }
  void do_deallocate(void* block, std::size_t, std::size_t alignment) override {
    ::operator delete (block, std::align_val_t{alignment});
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }
};

}  // namespace

std::pmr::memory_resource* large_pages() noexcept {
  static LargePages resource;
  return &resource;
}

void want_large_pages([[maybe_unused]] void* block, [[maybe_unused]] std::size_t bytes) noexcept {
#ifdef __linux__
  // Whole pages only, so that no block uses more memory than requested.
  const auto begin = reinterpret_cast<std::uintptr_t>(block);
  const std::uintptr_t first = (begin + page_bytes - 1) / page_bytes * page_bytes;
  const std::uintptr_t end = (begin + bytes) / page_bytes * page_bytes;
  if (first < end) madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);
#endif
}

}  // namespace throng

namespace throng::base {

std::pmr::memory_resource* large_blocks() noexcept {
  static LargeBlocks resource;
  return &resource;
}

}  // namespace throng::base
