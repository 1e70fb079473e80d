// The output: one bit or one byte per thread, thread k at bit k % 8 of byte k / 8. 32-bit words are
// the same bytes, lowest first.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "base/host_device_macros.hpp"

namespace throng::paper {

static_assert(std::endian::native == std::endian::little, "words of bits are read as bytes");

inline constexpr std::uint64_t bits_per_word = 32;

THRONG_HD constexpr std::uint64_t word_count(std::uint64_t bits) noexcept {
  return bits / bits_per_word + (bits % bits_per_word != 0);
}

// The number of bytes for this many bits, as in the paper: N/8, plus one for a remainder.
THRONG_HD constexpr std::uint64_t byte_count(std::uint64_t bits) noexcept {
  return bits / 8 + (bits % 8 != 0);
}

// Whether pair k overlaps.
THRONG_HD constexpr bool test_bit(const std::uint8_t* matrix, std::uint64_t k) noexcept {
  return (matrix[k / 8] >> (k % 8) & 1) != 0;
}

// Calls found(k) for each set bit of `bits`, in order.
template <class Found>
void for_each_bit(const std::uint32_t* words, std::uint64_t bits, Found&& found) {
  for (std::uint64_t w = 0; w < word_count(bits); ++w) {
    for (std::uint32_t rest = words[w]; rest != 0; rest &= rest - 1) {
      found(w * bits_per_word + static_cast<std::uint64_t>(std::countr_zero(rest)));
    }
  }
}

// The same for one byte per pair.
template <class Found>
void for_each_byte(const std::uint8_t* bytes, std::uint64_t count, Found&& found) {
  for (std::uint64_t k = 0; k < count; ++k) {
    if (bytes[k] != 0) found(k);
  }
}

}  // namespace throng::paper
