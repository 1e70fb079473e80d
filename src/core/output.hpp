// Memory for pairs, between the hall and a backend: as given, or growing.
#pragma once

#include <cstddef>

#include <throng/types.hpp>

namespace throng::core {

struct Output {
  Pair* data = nullptr;
  std::size_t capacity = 0;
  // Room for `count` pairs, contents lost; null where there is no memory. Null itself: does not
  // grow.
  Pair* (*grow)(void* context, std::size_t count) = nullptr;
  void* context = nullptr;
};

}  // namespace throng::core
