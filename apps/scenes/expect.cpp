// The expected number of pairs. Densities are solved from it, with the edges of the scene included,
// so that a scene has the same number of pairs per box at every n.
#include "apps/scenes/generator.hpp"

namespace throng::scenes {

double meeting_chance(double a, double b, double span) noexcept {
  // 1 minus the two corners of the square of (lower, lower) where one lies past the other.
  double p = 1;
  if (a < span) p -= (1 - a / span) * (1 - a / span) / 2;
  if (b < span) p -= (1 - b / span) * (1 - b / span) / 2;
  return p;
}

double expected_pairs(const std::vector<SizeClass>& classes, std::size_t n, const double span[3]) {
  double sum = 0;
  for (const SizeClass& a : classes) {
    for (const SizeClass& b : classes) {
      double p = a.share * b.share;
      for (int k = 0; k < 3; ++k) p *= meeting_chance(a.size[k], b.size[k], span[k]);
      sum += p;
    }
  }
  return n > 1 ? sum * static_cast<double>(n - 1) / 2 : 0;
}

double solve_span(const std::vector<SizeClass>& classes, std::size_t n, double pairs) {
  return solve_falling(
      [&](double span) {
        const double cube[3] = {span, span, span};
        return expected_pairs(classes, n, cube);
      },
      pairs);
}

}  // namespace throng::scenes
