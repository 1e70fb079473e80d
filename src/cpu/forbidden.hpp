// Boxes of one place of which filters let no two pair: where they are many, they are not compared
// with one another.
#pragma once

#include <cstdint>

#include "cpu/search.hpp"

namespace throng::cpu {

// The boxes of one owner, or of some kinds: no two of them may pair.
class Forbidden {
 public:
  // Of the boxes of a problem of which they are most, if they are more than half of them.
  Forbidden(const Search& search, const Problem& problem);

  // `second`: a target.
  bool has(bool second, std::uint32_t id) const noexcept {
    if (kinds_ != 0) return kinds_ >> search_.kinds->of(second)[id] & 1;
    return owner_ != -1 && (second ? search_.b : search_.a)->filters.owner[id] == owner_;
  }
  // How many of the queries and of the targets.
  std::uint64_t count(bool second) const noexcept { return count_[second]; }

 private:
  void find_owner(const Problem& problem);
  void find_kinds(const Problem& problem);
  std::uint64_t count_all(const Problem& problem);

  const Search& search_;
  std::int32_t owner_ = -1;
  std::uint32_t kinds_ = 0;  // a bit each
  std::uint64_t count_[2] = {0, 0};
};

}  // namespace throng::cpu
