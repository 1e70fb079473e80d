#include "apps/paper/root_shares.hpp"

#include <cmath>

namespace throng::paper {
namespace {

template <class Wide>
std::vector<std::uint64_t> count_wrong(const FastRootChoice& choice,
                                       const std::vector<std::uint64_t>& tests) {
  const FastRoot<Wide> root{choice.constant, choice.steps, choice.last};
  std::vector<std::uint64_t> counts;
  std::uint64_t wrong = 0, i = 0;
  for (const std::uint64_t end : tests) {
    for (; i < end; ++i) {
      const float x = static_cast<float>(i);
      // Neither is negative, and the largest is below 2^32: truncation is the floor.
      wrong += static_cast<std::int64_t>(root(x)) != static_cast<std::int64_t>(std::sqrt(x));
    }
    counts.push_back(wrong);
  }
  return counts;
}

}  // namespace

std::vector<std::uint64_t> wrong_roots(const FastRootChoice& choice,
                                       const std::vector<std::uint64_t>& tests) {
  return choice.wide ? count_wrong<double>(choice, tests) : count_wrong<float>(choice, tests);
}

}  // namespace throng::paper
