// Destination for pairs, passed from the API layer to a backend: fixed or growable.
#pragma once

#include <cstddef>

#include <throng/types.hpp>

namespace throng::base {

struct Output {
  Pair* data = nullptr;
  std::size_t capacity = 0;
  // Returns memory for `count` pairs (earlier contents are lost), or null if allocation fails. A
  // null function pointer: fixed capacity.
  Pair* (*grow)(void* context, std::size_t count) = nullptr;
  void* context = nullptr;
};

}  // namespace throng::base
