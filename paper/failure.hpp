// The error that ends a command early: see program/failure.hpp.
#pragma once

#include "program/failure.hpp"

namespace throng::paper {

using program::exit_bad;
using program::exit_differs;
using program::exit_done;
using program::Failure;

// A variant exceeds the memory limit: the caller may skip it.
class TooLarge : public Failure {
 public:
  using Failure::Failure;
};

}  // namespace throng::paper
