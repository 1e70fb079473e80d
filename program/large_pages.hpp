// Memory in large pages where the system has them for the asking.
#pragma once

#include <memory_resource>

namespace throng::program {

// New and delete, but that blocks of 16 MiB and more ask for large pages (Linux: transparent huge
// pages, often given to those alone that ask). A search that goes all over gigabytes then waits
// less for addresses to be looked up. May be used from any threads.
std::pmr::memory_resource* large_pages();

}  // namespace throng::program
