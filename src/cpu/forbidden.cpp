#include "cpu/forbidden.hpp"

#include <algorithm>

namespace throng::cpu {
namespace {

// Calls f(second, id) for all boxes of a problem.
template <class F>
void each_box(const Problem& problem, const F& f) {
  for (const bool second : {false, true}) {
    const Side& side = second ? problem.targets : problem.queries;
    for (std::uint32_t i = 0; i < side.count; ++i) f(second, side.id(i));
  }
}

}  // namespace

Forbidden::Forbidden(const Search& search, const Problem& problem) : search_(search) {
  if (search.owners) {
    find_owner(problem);
    if (2 * count_all(problem) > box_count(problem)) return;
    owner_ = -1;
  }
  if (search.kinds) {
    find_kinds(problem);
    if (2 * count_all(problem) > box_count(problem)) return;
    kinds_ = 0;
  }
  count_[0] = count_[1] = 0;
}

std::uint64_t Forbidden::count_all(const Problem& problem) {
  count_[0] = count_[1] = 0;
  each_box(problem, [&](bool second, std::uint32_t id) { count_[second] += has(second, id); });
  return count_[0] + count_[1];
}

// Boyer-Moore majority vote: an owner of more than half of the boxes remains at the end.
void Forbidden::find_owner(const Problem& problem) {
  std::uint64_t votes = 0;
  each_box(problem, [&](bool second, std::uint32_t id) {
    const std::int32_t owner = (second ? search_.b : search_.a)->filters.owner[id];
    if (votes == 0) owner_ = owner;
    votes = owner == owner_ ? votes + 1 : votes - 1;
  });
}

// Greedy: the most frequent class whose own boxes may not pair, then the next one that may pair
// with none of the selected, until there is none.
void Forbidden::find_kinds(const Problem& problem) {
  std::uint64_t boxes[Kinds::most] = {};
  each_box(problem, [&](bool second, std::uint32_t id) { ++boxes[search_.kinds->of(second)[id]]; });
  for (;;) {
    std::uint32_t best = Kinds::most;
    for (std::uint32_t k = 0; k < Kinds::most; ++k) {
      const std::uint32_t with = kinds_ | std::uint32_t{1} << k;
      if (boxes[k] == 0 || (search_.kinds->forbidden(k) & with) != with) continue;
      if (best == Kinds::most || boxes[k] > boxes[best]) best = k;
    }
    if (best == Kinds::most) return;
    kinds_ |= std::uint32_t{1} << best;
    boxes[best] = 0;
  }
}

}  // namespace throng::cpu
