// Signed integers for decisions that doubles cannot make. On the host only.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>

#include <throng/types.hpp>

namespace throng::mesh {

// A signed integer of at most 12800 bits. Only the limbs in use are computed and copied.
//
// Finite doubles are multiples of 2^-1074 below 2^1024, so differences of them are below 2^2099 in
// that unit. Products of six differences are below 2^12594: sums of up to 64 such fit.
class ExactInteger {
 public:
  ExactInteger() noexcept {}  // NOLINT: the limbs in use are none
  ExactInteger(const ExactInteger& other) noexcept { *this = other; }  // NOLINT: as above
  ExactInteger& operator=(const ExactInteger& other) noexcept {
    if (this == &other) return *this;
    size_ = other.size_;
    is_negative_ = other.is_negative_;
    std::copy(other.limb_, other.limb_ + size_, limb_);
    return *this;
  }
  // x / 2^unit, which must be an integer; x finite.
  ExactInteger(double x, int unit) noexcept : is_negative_(x < 0) {  // NOLINT: as above
    if (x == 0) return;
    int exponent;
    auto mantissa = static_cast<std::uint64_t>(std::ldexp(std::frexp(std::fabs(x), &exponent), 53));
    exponent -= 53 + unit;
    if (exponent < 0) {
      mantissa >>= -exponent;
      exponent = 0;
    }
    const int first = exponent / 32, rest = exponent % 32;
    std::fill(limb_, limb_ + first, 0);
    const std::uint64_t low = (mantissa & 0xffffffff) << rest;
    const std::uint64_t high = ((mantissa >> 32) << rest) + (low >> 32);
    limb_[first] = static_cast<std::uint32_t>(low);
    limb_[first + 1] = static_cast<std::uint32_t>(high);
    limb_[first + 2] = static_cast<std::uint32_t>(high >> 32);
    size_ = first + 3;
    trim();
  }

  // -1, 0 or 1
  int sign() const noexcept { return size_ == 0 ? 0 : is_negative_ ? -1 : 1; }
  int bit_count() const noexcept {
    return size_ == 0 ? 0 : 32 * size_ - std::countl_zero(limb_[size_ - 1]);
  }

  ExactInteger operator-() const noexcept {
    ExactInteger result = *this;
    result.is_negative_ = !is_negative_;
    return result;
  }
  friend ExactInteger operator+(const ExactInteger& x, const ExactInteger& y) noexcept {
    return x.plus(y, y.is_negative_);
  }
  friend ExactInteger operator-(const ExactInteger& x, const ExactInteger& y) noexcept {
    return x.plus(y, !y.is_negative_);
  }
  friend ExactInteger operator*(const ExactInteger& x, const ExactInteger& y) noexcept {
    ExactInteger result;
    if (x.size_ == 0 || y.size_ == 0) return result;
    result.size_ = x.size_ + y.size_;
    result.is_negative_ = x.is_negative_ != y.is_negative_;
    std::fill(result.limb_, result.limb_ + result.size_, 0);
    for (int i = 0; i < x.size_; ++i) {
      std::uint64_t carry = 0;
      for (int k = 0; k < y.size_; ++k) {
        carry += std::uint64_t{x.limb_[i]} * y.limb_[k] + result.limb_[i + k];
        result.limb_[i + k] = static_cast<std::uint32_t>(carry);
        carry >>= 32;
      }
      result.limb_[i + y.size_] = static_cast<std::uint32_t>(carry);
    }
    result.trim();
    return result;
  }
  friend bool operator<(const ExactInteger& x, const ExactInteger& y) noexcept {
    if (x.sign() != y.sign()) return x.sign() < y.sign();
    const int order = compare_magnitudes(x, y);
    return x.is_negative_ ? order > 0 : order < 0;
  }

  // numerator / denominator * 2^unit rounded to nearest, ties to even; denominator not 0. 0 has no
  // sign.
  friend double nearest_quotient(const ExactInteger& numerator, const ExactInteger& denominator,
                                 int unit) noexcept {
    if (numerator.size_ == 0) return 0;
    // |n| 2^shift / |d| is in (2^54, 2^56): 55 or 56 bits of the quotient, and then one for what
    // is left.
    const int shift = 55 - (numerator.bit_count() - denominator.bit_count());
    ExactInteger rest = numerator, divisor = denominator;
    rest.is_negative_ = divisor.is_negative_ = false;
    if (shift < 56)
      divisor.shift_left(56 - shift);
    else
      rest.shift_left(shift - 56);
    // rest / divisor is in (2^-2, 1).
    std::uint64_t quotient = 0;
    for (int i = 0; i < 56; ++i) {
      rest.shift_left(1);
      quotient <<= 1;
      if (compare_magnitudes(rest, divisor) >= 0) {
        rest = rest.plus(divisor, true);
        quotient |= 1;
      }
    }
    quotient = quotient << 1 | static_cast<std::uint64_t>(rest.size_ != 0);
    // The value is `quotient` * 2^exponent. What is rounded off: all but 53 bits, and what is
    // below 2^-1074.
    int exponent = unit - shift - 1;
    const int extra = std::max(static_cast<int>(std::bit_width(quotient)) - 53, -1074 - exponent);
    if (extra > 60) return 0;
    const std::uint64_t half = std::uint64_t{1} << (extra - 1);  // extra >= 3
    const std::uint64_t odd = quotient >> extra & 1;
    quotient = (quotient + (half - 1) + odd) >> extra;
    exponent += extra;
    const double magnitude = std::ldexp(static_cast<double>(quotient), exponent);
    return numerator.is_negative_ != denominator.is_negative_ ? -magnitude : magnitude;
  }

 private:
  static constexpr int capacity = 400;

  // -1, 0 or 1
  static int compare_magnitudes(const ExactInteger& x, const ExactInteger& y) noexcept {
    if (x.size_ != y.size_) return x.size_ < y.size_ ? -1 : 1;
    for (int i = x.size_; i-- > 0;)
      if (x.limb_[i] != y.limb_[i]) return x.limb_[i] < y.limb_[i] ? -1 : 1;
    return 0;
  }
  // *this + y, y with another sign.
  ExactInteger plus(const ExactInteger& y, bool y_is_negative) const noexcept {
    ExactInteger result;
    const bool grows = is_negative_ == y_is_negative;
    const bool y_is_larger = compare_magnitudes(*this, y) < 0;
    const ExactInteger& large = y_is_larger ? y : *this;
    const ExactInteger& small = y_is_larger ? *this : y;
    result.is_negative_ = y_is_larger ? y_is_negative : is_negative_;
    result.size_ = large.size_;
    std::int64_t carry = 0;
    for (int i = 0; i < large.size_; ++i) {
      const std::int64_t limb = i < small.size_ ? small.limb_[i] : 0;
      carry += large.limb_[i] + (grows ? limb : -limb);
      result.limb_[i] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    if (carry != 0) result.limb_[result.size_++] = static_cast<std::uint32_t>(carry);
    result.trim();
    return result;
  }
  void shift_left(int bits) noexcept {
    if (size_ == 0 || bits == 0) return;
    const int limbs = bits / 32, rest = bits % 32;
    limb_[size_ + limbs] = 0;
    for (int i = size_; i-- > 0;) {
      const std::uint64_t shifted = std::uint64_t{limb_[i]} << rest;
      limb_[i + limbs + 1] =
          (i + 1 == size_ ? 0 : limb_[i + limbs + 1]) | static_cast<std::uint32_t>(shifted >> 32);
      limb_[i + limbs] = static_cast<std::uint32_t>(shifted);
    }
    std::fill(limb_, limb_ + limbs, 0);
    size_ += limbs + 1;
    trim();
  }
  void trim() noexcept {
    while (size_ > 0 && limb_[size_ - 1] == 0) --size_;
  }

  int size_ = 0;
  bool is_negative_ = false;
  std::uint32_t limb_[capacity];  // least significant first; the last one in use is not 0
};

// The largest k for which x is a multiple of 2^k; x finite, not 0.
inline int lowest_bit(double x) noexcept {
  int exponent;
  const double mantissa = std::frexp(std::fabs(x), &exponent);
  return exponent - 53 + std::countr_zero(static_cast<std::uint64_t>(std::ldexp(mantissa, 53)));
}

// The largest k for which all are multiples of 2^k; 0 for zeros.
class CommonUnit {
 public:
  void include(double x) noexcept {
    if (x == 0) return;
    const int bit = lowest_bit(x);
    unit_ = is_set_ ? std::min(unit_, bit) : bit;
    is_set_ = true;
  }
  void include(const DoubleVec3& p) noexcept {
    for (const double x : {p.x, p.y, p.z}) include(x);
  }
  int value() const noexcept { return unit_; }

 private:
  int unit_ = 0;
  bool is_set_ = false;
};

struct ExactVector {
  ExactInteger x, y, z;

  ExactVector() noexcept = default;
  ExactVector(ExactInteger x_, ExactInteger y_, ExactInteger z_) noexcept  // NOLINT
      : x(x_), y(y_), z(z_) {}
  ExactVector(const DoubleVec3& p, int unit) noexcept : x(p.x, unit), y(p.y, unit), z(p.z, unit) {}
};

inline ExactVector operator-(const ExactVector& a, const ExactVector& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline ExactInteger dot(const ExactVector& a, const ExactVector& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline ExactVector cross(const ExactVector& a, const ExactVector& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace throng::mesh
