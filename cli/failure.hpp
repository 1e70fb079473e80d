// What ends a command early, and with which exit status.
#pragma once

#include "program/failure.hpp"

namespace throng::cli {

using program::exit_bad;
using program::exit_differs;
using program::exit_done;
using program::Failure;
inline constexpr int exit_interrupted = 130;  // 128 + SIGINT, as a shell tells it
inline constexpr int exit_broken_pipe = 141;  // 128 + SIGPIPE

}  // namespace throng::cli
