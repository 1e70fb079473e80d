// Copies boxes and meshes of any host layout, packed, to device memory.
#pragma once

#include <cstddef>
#include <type_traits>

#include <throng/boxes.hpp>
#include <throng/mesh.hpp>

#include "cuda/staging.hpp"

namespace throng::cuda {

// Each array has the alignment of a device allocation.
inline std::size_t aligned_size(std::size_t bytes) noexcept { return (bytes + 255) / 256 * 256; }

// Device bytes of the filters of `count` elements.
inline std::size_t bytes_on_device(const Filters& f, std::size_t count) noexcept {
  std::size_t sum = 0;
  for (const bool given : {bool(f.group), bool(f.mask), bool(f.owner), bool(f.world)})
    if (given) sum += aligned_size(count * 4);
  return sum + (f.is_static ? aligned_size(count) : 0);
}
// Of boxes, or of a mesh, and their filters.
inline std::size_t bytes_on_device(const Boxes& boxes) noexcept {
  return aligned_size(boxes.size() * sizeof(Box)) + bytes_on_device(boxes.filters, boxes.size());
}
inline std::size_t bytes_on_device(const TriangleMesh& mesh) noexcept {
  const std::size_t point = mesh.vertices.is_float() ? sizeof(Vec3) : sizeof(DoubleVec3);
  return aligned_size(mesh.vertices.size() * point) + aligned_size(mesh.size() * sizeof(Triangle)) +
         bytes_on_device(mesh.filters, mesh.size());
}

// Copies from(i), i < count, to `to`, which advances past them; returns where they are.
template <class From>
auto* upload_array(std::size_t count, const From& from, char*& to, Staging& staging,
                   cudaStream_t stream) {
  using T = std::decay_t<decltype(from(std::size_t{}))>;
  auto* at = reinterpret_cast<T*>(to);
  to += aligned_size(count * sizeof(T));
  staging.send(at, count, stream, from);
  return at;
}
inline void upload_filters(const Filters& from, Filters& view, std::size_t count, char*& to,
                           Staging& staging, cudaStream_t stream) {
  const auto filter = [&](auto& column, const auto& values) {
    if (!values) return;
    column = {upload_array(
                  count, [&](std::size_t i) { return values[i]; }, to, staging, stream),
              count};
  };
  filter(view.group, from.group);
  filter(view.mask, from.mask);
  filter(view.owner, from.owner);
  filter(view.world, from.world);
  filter(view.is_static, from.is_static);
}

// Copies to `to`, which advances past the data; returns a view of the copy. The host's arrays have
// been read when this returns.
inline Boxes upload(const Boxes& boxes, char*& to, Staging& staging, cudaStream_t stream) {
  const std::size_t n = boxes.size();
  Boxes view(upload_array(
                 n, [&](std::size_t i) { return boxes[i]; }, to, staging, stream),
             n);
  upload_filters(boxes.filters, view.filters, n, to, staging, stream);
  return view;
}
inline TriangleMesh upload(const TriangleMesh& mesh, char*& to, Staging& staging,
                           cudaStream_t stream) {
  const std::size_t n = mesh.size(), vertices = mesh.vertices.size();
  const auto points = [&](auto point) {
    using Point = decltype(point);
    const auto* const first = static_cast<const char*>(mesh.vertices.data());
    const std::size_t stride = mesh.vertices.stride_bytes();
    const auto at = [&](std::size_t i) {
      return *reinterpret_cast<const Point*>(first + i * stride);
    };
    return Vertices(upload_array(vertices, at, to, staging, stream), vertices);
  };
  const Vertices there = mesh.vertices.is_float() ? points(Vec3()) : points(DoubleVec3());
  TriangleMesh view(there,
                    upload_array(
                        n, [&](std::size_t i) { return mesh.triangles[i]; }, to, staging, stream),
                    n);
  view.transform = mesh.transform;
  upload_filters(mesh.filters, view.filters, n, to, staging, stream);
  return view;
}

}  // namespace throng::cuda
