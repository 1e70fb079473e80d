// The combinations of filters that living objects have, where they are few: what two of them say is
// looked up.
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

// A kind is a combination of all but the owner, of which there may be as many as objects.
class FilterKinds {
 public:
  // A number of 5 bits; the last stands for whatever has found no other.
  static constexpr std::uint8_t others = 31;

  // Of one object more.
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
  // Of one object less.
  void remove(std::uint8_t kind) noexcept { --count_[kind]; }

  // Whether two objects of these kinds may pair; of others, and of owners, more is to be asked.
  bool allow(std::uint8_t a, std::uint8_t b) const noexcept { return (allowed_[a] >> b & 1) != 0; }
  bool has_others() const noexcept { return count_[others] != 0; }
  // A bit for each kind that it may pair with: the same for kinds that need not be told apart.
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
