// The error that ends a command early: see apps/common/failure.hpp.
#pragma once

#include "apps/common/failure.hpp"

namespace throng::paper {

using common::exit_bad;
using common::exit_differs;
using common::exit_done;
using common::Failure;

// A variant exceeds the memory limit: the caller may skip it.
class TooLarge : public Failure {
 public:
  using Failure::Failure;
};

}  // namespace throng::paper
