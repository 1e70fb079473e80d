// Copies boxes of any host layout, packed, to device memory.
#pragma once

#include <cstddef>
#include <type_traits>

#include <throng/boxes.hpp>

#include "cuda/staging.hpp"

namespace throng::cuda {

// Each array has the alignment of a device allocation.
inline std::size_t aligned_size(std::size_t bytes) noexcept { return (bytes + 255) / 256 * 256; }

// Device bytes of a set of boxes and its filters.
inline std::size_t bytes_on_device(const Boxes& boxes) noexcept {
  std::size_t sum = aligned_size(boxes.size() * sizeof(Box));
  const Filters& f = boxes.filters;
  for (const bool given : {bool(f.group), bool(f.mask), bool(f.owner), bool(f.world)})
    if (given) sum += aligned_size(boxes.size() * 4);
  return sum + (f.is_static ? aligned_size(boxes.size()) : 0);
}

// Copies to `to`, which advances past the data; returns a view of the copy. The host's arrays have
// been read when this returns.
inline Boxes upload(const Boxes& boxes, char*& to, Staging& staging, cudaStream_t stream) {
  const std::size_t n = boxes.size();
  const auto copy = [&](const auto& from) {
    using T = std::decay_t<decltype(from[0])>;
    auto* at = reinterpret_cast<T*>(to);
    to += aligned_size(n * sizeof(T));
    staging.send(at, n, stream, [&](std::size_t i) { return from[i]; });
    return at;
  };
  Boxes view(copy(boxes), n);
  const auto filter = [&](auto& column, const auto& from) {
    if (from) column = {copy(from), n};
  };
  filter(view.filters.group, boxes.filters.group);
  filter(view.filters.mask, boxes.filters.mask);
  filter(view.filters.owner, boxes.filters.owner);
  filter(view.filters.world, boxes.filters.world);
  filter(view.filters.is_static, boxes.filters.is_static);
  return view;
}

}  // namespace throng::cuda
