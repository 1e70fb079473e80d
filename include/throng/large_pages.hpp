// Memory in large pages where the system has them for the asking.
#pragma once

#include <memory_resource>

#include <throng/export.h>

namespace throng {

// For Options::memory. As new and delete, but that blocks of 2 MiB and more ask for large pages
// (Linux: transparent huge pages, often given to those alone that ask). Where much else has used
// the caches between two frames, or there are gigabytes, a search waits less for addresses to be
// looked up. The first time that such a page is written the system empties all of it. May be used
// from any threads; lives as long as the program.
THRONG_API std::pmr::memory_resource* large_pages() noexcept;

}  // namespace throng
