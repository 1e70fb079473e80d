// The words of the two axes across the sweep, cut to a byte each: of two boxes one comparison of
// four bytes tells for almost all whether they overlap there.
//
// A word w becomes s(w) = min(w >> 7, 253), which decreases nowhere. Of the boxes a, b
//   s(a.lower) > s(b.upper)  implies  a.lower > b.upper,  and
//   s(a.lower) < s(b.upper)  implies  a.lower < b.upper;
// equal bytes leave the decision to the words. A box has for each axis the bytes 1 + s(lower) and
// 254
// - s(upper), from 1 to 254, and asks with 1 + s(upper) and 254 - s(lower), in that order: it may
// meet another only if no byte of that is above its own, and meets it for sure, as far as these
// axes go, if all are below. What a box asks with are its own bytes, swapped by twos and
// complemented. A byte of 255, beyond the last box, is above all.
#pragma once

#include <cstdint>

#include "core/quantise.hpp"

namespace throng::cpu {

constexpr int side_shift = core::word_bits - 8;
constexpr std::uint16_t most_side = 253;
constexpr std::uint32_t no_sides = 0xffffffffu;
// From what may be met to what is met for sure: no byte is 0.
constexpr std::uint32_t surely = 0x01010101u;

}  // namespace throng::cpu
