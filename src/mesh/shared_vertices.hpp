// How two triangles share vertices, by a table over the nine comparisons of their indices.
#pragma once

#include <array>
#include <cstdint>

#include <throng/mesh.hpp>

#include "base/host_device_macros.hpp"

namespace throng::mesh {

// Which test a candidate pair takes.
enum class Sharing : std::uint8_t {
  none,    // no common vertex
  vertex,  // one: position 0 of both orders
  edge,    // two: positions 0 and 1 of both orders
  other,   // three, or a triangle repeats an index: the exact test
};

// The orders list the positions of a triangle's vertices, shared ones first.
struct SharedVertices {
  Sharing sharing = Sharing::none;
  std::uint8_t a[3] = {0, 1, 2}, b[3] = {0, 1, 2};
};

// Bit 3 i + k is set if index i of a equals index k of b.
THRONG_HD inline unsigned equal_indices(const Triangle& a, const Triangle& b) noexcept {
  const auto row = [&](std::uint32_t i) {
    return static_cast<unsigned>(i == b.a) | static_cast<unsigned>(i == b.b) << 1 |
           static_cast<unsigned>(i == b.c) << 2;
  };
  return row(a.a) | row(a.b) << 3 | row(a.c) << 6;
}

THRONG_HD constexpr SharedVertices shared_vertices(unsigned equal) noexcept {
  SharedVertices shared;
  int count = 0, of_a[3] = {}, of_b[3] = {};
  bool in_a[3] = {}, in_b[3] = {};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      if ((equal >> (3 * i + k) & 1) == 0) continue;
      if (in_a[i] || in_b[k] || count == 2) {
        shared.sharing = Sharing::other;
        return shared;
      }
      in_a[i] = in_b[k] = true;
      of_a[count] = i;
      of_b[count++] = k;
    }
  }
  shared.sharing = count == 0 ? Sharing::none : (count == 1 ? Sharing::vertex : Sharing::edge);
  int next_a = count, next_b = count;
  for (int i = 0; i < count; ++i) {
    shared.a[i] = static_cast<std::uint8_t>(of_a[i]);
    shared.b[i] = static_cast<std::uint8_t>(of_b[i]);
  }
  for (int i = 0; i < 3; ++i) {
    if (!in_a[i]) shared.a[next_a++] = static_cast<std::uint8_t>(i);
    if (!in_b[i]) shared.b[next_b++] = static_cast<std::uint8_t>(i);
  }
  return shared;
}

// shared_vertices() of all arguments.
inline constexpr std::array<SharedVertices, 512> shared_vertices_table = [] {
  std::array<SharedVertices, 512> table{};
  for (unsigned equal = 0; equal < 512; ++equal) table[equal] = shared_vertices(equal);
  return table;
}();

// The orders of shared_vertices_table for vectors of bytes: byte n of the ordered indices is byte
// a[n] of a's, in the order of memory. a[12] is the Sharing, the rest is any.
struct VertexOrder {
  alignas(16) std::uint8_t a[16], b[16];
};
inline constexpr std::array<VertexOrder, 512> vertex_orders = [] {
  std::array<VertexOrder, 512> table{};
  for (unsigned equal = 0; equal < 512; ++equal) {
    const SharedVertices& shared = shared_vertices_table[equal];
    table[equal].a[12] = static_cast<std::uint8_t>(shared.sharing);
    for (unsigned n = 0; n < 12; ++n) {
      table[equal].a[n] = static_cast<std::uint8_t>(4 * shared.a[n / 4] + n % 4);
      table[equal].b[n] = static_cast<std::uint8_t>(4 * shared.b[n / 4] + n % 4);
    }
  }
  return table;
}();

}  // namespace throng::mesh
