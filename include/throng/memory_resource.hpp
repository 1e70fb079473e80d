// std::pmr::memory_resource, also where the standard library has only its predecessor (libc++
// before 16).
#pragma once

#include <throng/cpp17.hpp>

#if __has_include(<memory_resource>)
#include <memory_resource>
#else
#include <experimental/memory_resource>
namespace std::pmr {
using std::experimental::pmr::memory_resource;
}  // namespace std::pmr
#endif
