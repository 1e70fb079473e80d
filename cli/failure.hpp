// The error that ends a command early, and its exit status.
#pragma once

#include "program/failure.hpp"

namespace throng::cli {

using program::exit_bad;
using program::exit_differs;
using program::exit_done;
using program::Failure;
inline constexpr int exit_broken_pipe = 141;  // 128 + SIGPIPE, as shells report it

}  // namespace throng::cli
