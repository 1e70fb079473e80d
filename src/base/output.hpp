// Destination for pairs, passed from the API layer to a backend: fixed or growable.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

namespace throng::base {

struct Output {
  Pair* data = nullptr;
  std::size_t capacity = 0;
  // Returns memory for `count` pairs (earlier contents are lost), or null if allocation fails. A
  // null function pointer: fixed capacity.
  Pair* (*grow)(void* context, std::size_t count) = nullptr;
  void* context = nullptr;

  // Gets memory for `count` pairs; false, with `data` null, if there is none. A count of pairs may
  // exceed what a size_t holds.
  bool grow_to(std::uint64_t count) {
    constexpr std::uint64_t most = static_cast<std::size_t>(-1) / sizeof(Pair);
    data = count <= most ? grow(context, static_cast<std::size_t>(count)) : nullptr;
    capacity = data ? static_cast<std::size_t>(count) : 0;
    return data != nullptr;
  }
};

}  // namespace throng::base
