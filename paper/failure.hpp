// What ends a command early: see program/failure.hpp.
#pragma once

#include "program/failure.hpp"

namespace throng::paper {

using program::exit_bad;
using program::exit_differs;
using program::exit_done;
using program::Failure;

// A variant takes more memory than is allowed: one may leave it out and go on.
class TooLarge : public Failure {
 public:
  using Failure::Failure;
};

}  // namespace throng::paper
