// The default memory resource of a Finder.
#pragma once

#include <throng/memory_resource.hpp>

namespace throng::base {

// Like new and delete, with madvise for large pages on the whole ones that a block contains. Unlike
// large_pages() it does not align blocks to large pages: blocks that live for one call are often
// reused from the last call as they are, at no cost.
std::pmr::memory_resource* large_blocks() noexcept;

}  // namespace throng::base
