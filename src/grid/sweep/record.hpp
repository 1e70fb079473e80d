// A box in a column: what the sweep reads of it, and the rule that reports each pair once.
#pragma once

#include <algorithm>
#include <cstdint>

#include "grid/sweep/reject_mask.hpp"

namespace throng::grid {

// The bounds of a box in a column, 15 bits each. See base/quantize.hpp.
struct QuantizedBox {
  std::uint16_t lower[3], upper[3];

  // The test of two boxes, as the vector kernels do it (kernels_box_test-inl.hpp): the least of six
  // differences. Above 0 the boxes overlap, below 0 they do not; 0 is a tie, which the floats
  // decide.
  constexpr int least_difference(const QuantizedBox& other) const noexcept {
    int least = upper[0] - other.lower[0];
    for (int k = 0; k < 3; ++k)
      least = std::min({least, upper[k] - other.lower[k], other.upper[k] - lower[k]});
    return least;
  }
};

struct Record : QuantizedBox {
  std::uint32_t id;
};
// The kernels read a record as one vector of eight 16-bit values.
static_assert(sizeof(QuantizedBox) == 12 && sizeof(Record) == 16);

// Two boxes may share several columns. One of these, their owner cell, reports the pair: the one
// that is, on every axis, the first column of one of the two boxes. The proof is in
// base/quantize.hpp.
struct OwnerRule {
  // A box that starts in an earlier column on some axis has a lower bound of 0 there. A column
  // rejects two boxes that both do on the same axis.
  static constexpr RejectMask mask(const QuantizedBox& box) noexcept {
    std::uint32_t bits = 0;
    for (unsigned k = 0; k < 3; ++k) bits |= (box.lower[k] == 0 ? 1u : 0u) << k;
    return RejectMask::from_bits(bits);
  }
};

}  // namespace throng::grid
