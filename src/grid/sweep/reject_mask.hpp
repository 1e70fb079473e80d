// Which pairs of boxes a column must not report.
#pragma once

#include <cstdint>

namespace throng::grid {

// A box has one mask as query and one as target: the same array unless filters give them different
// bits. A pair is rejected if the query's and the target's mask share a bit.
//
//   from bit     set by                       two boxes share one if
//   0            OwnerRule, from the records  both start in an earlier column, on axis 0, 1 or 2
//   3, 6, ...    nested(), three per level    the same, in the column of an enclosing grid
//   set_bit      of_set(), without nesting    both are of the first set, or both of the second
//   filter_bit   FilterClasses                a filter forbids the pair; see filter_classes.hpp
//
// Grids with filters have fewer levels, so that these do not meet. Bit 15 stays 0: the vector
// kernels compare masks as signed numbers.
class RejectMask {
 public:
  static constexpr unsigned bits_per_level = 3, set_bit = 3, filter_bit = 9, filter_bits = 6;
  // Grids inside each other: each has the bits of all that enclose it.
  static constexpr unsigned max_levels = 4, max_levels_with_filters = 3;
  static_assert(max_levels * bits_per_level < 16 && set_bit + 2 <= filter_bit);
  static_assert(max_levels_with_filters * bits_per_level <= filter_bit);
  static_assert(filter_bit + filter_bits < 16);

  constexpr RejectMask() = default;
  static constexpr RejectMask from_bits(std::uint32_t bits) noexcept {
    return RejectMask(static_cast<std::uint16_t>(bits));
  }
  static constexpr RejectMask of_set(bool second) noexcept {
    return from_bits(second ? 2u << set_bit : 1u << set_bit);
  }

  static constexpr RejectMask of_filter(unsigned bit) noexcept {
    return from_bits(1u << (filter_bit + bit));
  }

  constexpr bool rejects(RejectMask target) const noexcept { return (bits_ & target.bits_) != 0; }
  constexpr RejectMask operator|(RejectMask other) const noexcept {
    return from_bits(bits_ | std::uint32_t{other.bits_});
  }
  // The mask as of a grid inside this column: the axes move up one level, filters are set again.
  constexpr RejectMask nested(bool has_filters) const noexcept {
    const std::uint32_t axes = has_filters ? (1u << filter_bit) - 1 : ~0u;
    return from_bits((bits_ & axes) << bits_per_level);
  }
  constexpr bool is_empty() const noexcept { return bits_ == 0; }
  // Without the bits of filters.
  constexpr RejectMask axes_only(bool has_filters) const noexcept {
    return from_bits(bits_ & (has_filters ? (1u << filter_bit) - 1 : ~0u));
  }

 private:
  explicit constexpr RejectMask(std::uint16_t bits) noexcept : bits_(bits) {}
  std::uint16_t bits_ = 0;
};

}  // namespace throng::grid
