// Filter classes: the distinct filters in use, if they are few, with a table of which may pair.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/broad_phase.hpp>

namespace throng::tracking {

inline bool allows(const Filter& a, const Filter& b) noexcept {
  return (a.group & b.mask) != 0 && (b.group & a.mask) != 0 &&
         (a.owner == -1 || a.owner != b.owner) &&
         (a.world == -1 || b.world == -1 || a.world == b.world) && !(a.is_static && b.is_static);
}

// A class is a distinct filter without its owner; owners may be as many as objects.
class FilterClassTable {
 public:
  // A class number has 5 bits; the last one means: no class was free.
  static constexpr std::uint8_t overflow_class = 31;

  // Counts an object; returns its class.
  std::uint8_t add(const Filter& filter) noexcept {
    Filter one = filter;
    one.owner = -1;
    std::uint8_t filter_class = overflow_class;
    for (std::uint8_t k = overflow_class; k-- > 0;) {
      if (count_[k] == 0) {
        filter_class = k;
      } else if (same(filters_[k], one)) {
        filter_class = k;
        break;
      }
    }
    if (count_[filter_class]++ == 0 && filter_class != overflow_class) set_class(filter_class, one);
    return filter_class;
  }
  // Counts an object less.
  void remove(std::uint8_t filter_class) noexcept { --count_[filter_class]; }

  // Whether two classes may pair. Not final for class `overflow_class` or if owners are in use.
  bool allow(std::uint8_t a, std::uint8_t b) const noexcept { return (allowed_[a] >> b & 1) != 0; }
  bool has_overflow() const noexcept { return count_[overflow_class] != 0; }
  // A bit per class it may pair with; equal for classes that pair alike.
  std::uint32_t allowed(std::uint8_t filter_class) const noexcept { return allowed_[filter_class]; }

 private:
  static bool same(const Filter& a, const Filter& b) noexcept {
    return a.group == b.group && a.mask == b.mask && a.world == b.world &&
           (a.is_static != 0) == (b.is_static != 0);
  }
  void set_class(std::uint8_t filter_class, const Filter& one) noexcept {
    filters_[filter_class] = one;
    allowed_[overflow_class] = ~std::uint32_t{0};
    for (std::uint8_t k = 0; k < overflow_class; ++k) {
      const std::uint32_t allow = count_[k] != 0 && allows(filters_[k], one) ? 1 : 0;
      allowed_[k] = (allowed_[k] & ~(std::uint32_t{1} << filter_class)) | allow << filter_class;
      allowed_[filter_class] = (allowed_[filter_class] & ~(std::uint32_t{1} << k)) | allow << k;
    }
    allowed_[filter_class] |= std::uint32_t{1} << overflow_class;
  }

  Filter filters_[overflow_class];
  std::size_t count_[overflow_class + 1] = {};
  std::uint32_t allowed_[overflow_class + 1] = {};
};

}  // namespace throng::tracking
