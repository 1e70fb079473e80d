// Memory in large pages where the system has them for the asking.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <memory_resource>

#include <throng/export.h>

namespace throng {

// For Options::memory; what a BroadPhase takes where that is null. As new and delete, but that
// blocks of 2 MiB and more begin with a large page and ask for such (Linux: transparent huge pages,
// often given to those alone that ask). Fewer pages are to be found by the system at the first use,
// and where much else has used the caches between two frames, or there are gigabytes, a search
// waits less for addresses to be looked up. May be used from any threads; lives as long as the
// program.
THRONG_API std::pmr::memory_resource* large_pages() noexcept;

// Asks for them in memory of yours that is yet to be written, such as room for many pairs: in as
// many whole ones as lie in these bytes. A wish; nothing where there is none, or it is refused.
THRONG_API void want_large_pages(void* block, std::size_t bytes) noexcept;

}  // namespace throng
