// Memory where the caller names no resource.
#pragma once

#include <cstddef>
#include <memory_resource>

namespace throng::cpu {

// What a search takes memory from: as new and delete, but that large blocks ask for large pages,
// where they have whole ones. The system then has fewer to find, and addresses are looked up
// sooner. What lives long takes large_pages().
std::pmr::memory_resource* large_blocks() noexcept;

// Asks for large pages in a block that is yet to be written.
void want_large_pages(void* block, std::size_t bytes) noexcept;

}  // namespace throng::cpu
