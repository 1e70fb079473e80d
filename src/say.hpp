// How the hall puts what went wrong into words.
#pragma once

#include <cstdarg>
#include <cstdio>

#include <throng/options.hpp>

namespace throng {

using ull = unsigned long long;

#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
inline void
say(Result& r, const char* format, ...) noexcept {
  std::va_list args;
  va_start(args, format);
  std::vsnprintf(r.message, sizeof r.message, format, args);
  va_end(args);
}

inline bool refuse(Result& r, Status status) noexcept {
  r.status = status;
  return false;
}

}  // namespace throng
