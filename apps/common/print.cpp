#include "apps/common/print.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

#include "apps/common/failure.hpp"

namespace throng::common {

void print(const std::string& text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw Failure(fmt::format("standard output cannot be written: {}", std::strerror(errno)));
  }
}

}  // namespace throng::common
