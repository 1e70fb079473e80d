// The error that ends a command early, and its exit status.
#pragma once

#include "apps/common/failure.hpp"

namespace throng::cli {

using common::exit_bad;
using common::exit_differs;
using common::exit_done;
using common::Failure;
inline constexpr int exit_broken_pipe = 141;  // 128 + SIGPIPE, as shells report it

}  // namespace throng::cli
