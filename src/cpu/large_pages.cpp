#include <throng/large_pages.hpp>

#include <cstddef>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace throng {
namespace {

constexpr std::size_t page_bytes = std::size_t{2} << 20;

class LargePages final : public std::pmr::memory_resource {
  // The alignment of a block depends on its size alone, which deallocate is told, too.
  static std::align_val_t alignment_of(std::size_t bytes, std::size_t alignment) {
    return std::align_val_t{bytes >= page_bytes && alignment < page_bytes ? page_bytes : alignment};
  }
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    void* block = ::operator new(bytes, alignment_of(bytes, alignment));
#ifdef __linux__
    // A wish: without it, or where it is refused, all works as well. Of whole pages alone, so that
    // no block takes more than was asked for.
    if (bytes >= page_bytes) madvise(block, bytes / page_bytes * page_bytes, MADV_HUGEPAGE);
#endif
    return block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    ::operator delete(block, alignment_of(bytes, alignment));
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

}  // namespace throng
