// Memory of a Finder whose caller names no resource.
#pragma once

#include <memory_resource>

namespace throng::cpu {

// As new and delete, but that blocks ask for large pages where they have whole ones. Such as live
// for one search are often those of the search before, and cost nothing then; so they are taken as
// they come, and not made to begin with a large page as by large_pages().
std::pmr::memory_resource* large_blocks() noexcept;

}  // namespace throng::cpu
