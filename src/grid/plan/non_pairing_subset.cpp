#include "grid/plan/non_pairing_subset.hpp"

#include <algorithm>

namespace throng::grid {
namespace {

// Calls f(second, id) for all boxes of a problem.
template <class F>
void each_box(const Problem& problem, const F& f) {
  for (const bool second : {false, true}) {
    const BoxSubset& side = second ? problem.targets : problem.queries;
    for (std::uint32_t i = 0; i < side.count; ++i) f(second, side.id(i));
  }
}

}  // namespace

NonPairingSubset::NonPairingSubset(const Search& search, const Problem& problem) : search_(search) {
  if (search.owners) {
    find_owner(problem);
    if (2 * count_all(problem) > box_count(problem)) return;
    owner_ = -1;
  }
  if (search.filter_classes) {
    find_classes(problem);
    if (2 * count_all(problem) > box_count(problem)) return;
    filter_classes_ = 0;
  }
  count_[0] = count_[1] = 0;
}

std::uint64_t NonPairingSubset::count_all(const Problem& problem) {
  count_[0] = count_[1] = 0;
  each_box(problem, [&](bool second, std::uint32_t id) { count_[second] += has(second, id); });
  return count_[0] + count_[1];
}

// Boyer-Moore majority vote: an owner of more than half of the boxes remains at the end.
void NonPairingSubset::find_owner(const Problem& problem) {
  std::uint64_t votes = 0;
  each_box(problem, [&](bool second, std::uint32_t id) {
    const std::int32_t owner = (second ? search_.b : search_.a)->filters.owner[id];
    if (votes == 0) owner_ = owner;
    votes = owner == owner_ ? votes + 1 : votes - 1;
  });
}

// Greedy: the most frequent class whose own boxes may not pair, then the next one that may pair
// with none of the selected, until there is none.
void NonPairingSubset::find_classes(const Problem& problem) {
  std::uint64_t boxes[FilterClasses::most] = {};
  each_box(problem,
           [&](bool second, std::uint32_t id) { ++boxes[search_.filter_classes->of(second)[id]]; });
  for (;;) {
    std::uint32_t best = FilterClasses::most;
    for (std::uint32_t k = 0; k < FilterClasses::most; ++k) {
      const std::uint32_t with = filter_classes_ | std::uint32_t{1} << k;
      if (boxes[k] == 0 || (search_.filter_classes->forbidden(k) & with) != with) continue;
      if (best == FilterClasses::most || boxes[k] > boxes[best]) best = k;
    }
    if (best == FilterClasses::most) return;
    filter_classes_ |= std::uint32_t{1} << best;
    boxes[best] = 0;
  }
}

}  // namespace throng::grid
