// Boxes in one place of which no two may pair by the filters: if there are many, they are not
// compared with each other.
#pragma once

#include <cstdint>

#include "grid/search.hpp"

namespace throng::grid {

// The boxes of one owner, or of some filter classes: no two of them may pair.
class NonPairingSubset {
 public:
  // Selects the largest such subset, if it is more than half of the problem's boxes.
  NonPairingSubset(const Search& search, const Problem& problem);

  // `second`: the box is a target.
  bool has(bool second, std::uint32_t id) const noexcept {
    if (filter_classes_ != 0) return filter_classes_ >> search_.filter_classes->of(second)[id] & 1;
    return owner_ != -1 && (second ? search_.b : search_.a)->filters.owner[id] == owner_;
  }
  // Number of such queries or targets.
  std::uint64_t count(bool second) const noexcept { return count_[second]; }

 private:
  void find_owner(const Problem& problem);
  void find_classes(const Problem& problem);
  std::uint64_t count_all(const Problem& problem);

  const Search& search_;
  std::int32_t owner_ = -1;
  std::uint32_t filter_classes_ = 0;  // one bit per class
  std::uint64_t count_[2] = {0, 0};
};

}  // namespace throng::grid
