// Filter classes: the distinct filters in use, if they are few, with a table of which may pair.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/broad_phase.hpp>

namespace throng::live {

inline bool allows(const Filter& a, const Filter& b) noexcept {
  return (a.group & b.mask) != 0 && (b.group & a.mask) != 0 &&
         (a.owner == -1 || a.owner != b.owner) &&
         (a.world == -1 || b.world == -1 || a.world == b.world) && !(a.is_static && b.is_static);
}

// A class is a distinct filter without its owner; owners may be as many as objects.
class FilterKinds {
 public:
  // A class number has 5 bits; the last one means: no class was free.
  static constexpr std::uint8_t others = 31;

  // Counts an object; returns its class.
  std::uint8_t add(const Filter& filter) noexcept {
    Filter one = filter;
    one.owner = -1;
    std::uint8_t kind = others;
    for (std::uint8_t k = others; k-- > 0;) {
      if (count_[k] == 0) {
        kind = k;
      } else if (same(of_[k], one)) {
        kind = k;
        break;
      }
    }
    if (count_[kind]++ == 0 && kind != others) enter(kind, one);
    return kind;
  }
  // Counts an object less.
  void remove(std::uint8_t kind) noexcept { --count_[kind]; }

  // Whether two classes may pair. Not final for class `others` or if owners are in use.
  bool allow(std::uint8_t a, std::uint8_t b) const noexcept { return (allowed_[a] >> b & 1) != 0; }
  bool has_others() const noexcept { return count_[others] != 0; }
  // A bit per class it may pair with; equal for classes that pair alike.
  std::uint32_t allowed(std::uint8_t kind) const noexcept { return allowed_[kind]; }

 private:
  static bool same(const Filter& a, const Filter& b) noexcept {
    return a.group == b.group && a.mask == b.mask && a.world == b.world &&
           (a.is_static != 0) == (b.is_static != 0);
  }
  void enter(std::uint8_t kind, const Filter& one) noexcept {
    of_[kind] = one;
    allowed_[others] = ~std::uint32_t{0};
    for (std::uint8_t k = 0; k < others; ++k) {
      const std::uint32_t allow = count_[k] != 0 && allows(of_[k], one) ? 1 : 0;
      allowed_[k] = (allowed_[k] & ~(std::uint32_t{1} << kind)) | allow << kind;
      allowed_[kind] = (allowed_[kind] & ~(std::uint32_t{1} << k)) | allow << k;
    }
    allowed_[kind] |= std::uint32_t{1} << others;
  }

  Filter of_[others];
  std::size_t count_[others + 1] = {};
  std::uint32_t allowed_[others + 1] = {};
};

}  // namespace throng::live
