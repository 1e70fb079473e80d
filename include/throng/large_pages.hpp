// A memory resource that uses large pages where the system provides them on request.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>

#include <throng/export.h>
#include <throng/memory_resource.hpp>

namespace throng {

// For Options::memory; the default of BroadPhase. Like new and delete, but blocks of 2 MiB or more
// are aligned to large pages and request them (Linux: transparent huge pages, which many systems
// grant only on request). This reduces page faults at first use, and TLB misses for gigabytes of
// data or if other work evicts the caches between frames. Thread-safe; static lifetime.
THRONG_API std::pmr::memory_resource* large_pages() noexcept;

// Requests large pages for the whole large pages within caller-owned memory that is not written
// yet, such as a buffer for many pairs. A hint: no effect if unsupported or refused.
THRONG_API void want_large_pages(void* block, std::size_t bytes) noexcept;

}  // namespace throng
