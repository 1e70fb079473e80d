// What goes wrong in a pipeline; thrown inside the library only. The hall puts it into words.
#pragma once

#include <cstddef>

#include <throng/options.hpp>

namespace throng::pipeline {

struct Failure {
  Status status;
  std::size_t bytes = 0;       // asked for in vain, or needed
  const char* text = nullptr;  // what a device says of it
  const char* what = nullptr;  // the array that it is said of
};

}  // namespace throng::pipeline
