// The test of a block of candidate pairs, one function per instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

#include "mesh/arrays.hpp"

namespace throng::mesh {

struct PairKernels {
  Isa isa;
  // Moves the pairs of triangles that intersect to the front, in any order; returns their number.
  // Adds the number of exact tests to `exact_tests`.
  std::size_t (*keep)(const PairInput&, Pair*, std::size_t count, std::uint64_t& exact_tests);
  // Writes the boxes of triangles begin .. end-1 with vertices of floats to out[begin] and on, and
  // the box that contains them to `bounds`. False: an index is not below `vertices`, or the sum of
  // a triangle's coordinates is not finite; out and bounds are then undefined. Null: not available.
  bool (*write_boxes)(const MeshArrays&, std::size_t vertices, std::size_t begin, std::size_t end,
                      Box* out, Box& bounds);
};

// The vector kernels; null for scalar and for what the build lacks. Precondition: the processor has
// the instruction set.
const PairKernels* simd_pair_kernels(Isa isa) noexcept;
extern const PairKernels scalar_pair_kernels;

// One candidate, by the filter of doubles or by the exact rule, which is counted.
bool decide_pair(const PairInput& input, Pair pair, std::uint64_t& exact_tests) noexcept;

}  // namespace throng::mesh
