// What ends a command early: see program/failure.hpp.
#pragma once

#include "program/failure.hpp"

namespace throng::paper {

using program::exit_bad;
using program::exit_differs;
using program::exit_done;
using program::Failure;

}  // namespace throng::paper
