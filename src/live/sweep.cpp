#include "live/sweep.hpp"

#include <cmath>
#include <utility>

namespace throng::live {

void axes_of(const Sweep& s, SweepAxis (&axes)[3]) noexcept {
  axes[0] = {s.box.lower.x, s.box.upper.x, s.by.x};
  axes[1] = {s.box.lower.y, s.box.upper.y, s.by.y};
  axes[2] = {s.box.lower.z, s.box.upper.z, s.by.z};
}

// Divisions and differences of floats in doubles neither overflow nor make a NaN, but where an
// infinite bound meets an infinite one: those are at the same place from the start.
Touch touch(const Sweep& sweep, const Box& b) noexcept {
  SweepAxis axes[3];
  axes_of(sweep, axes);
  const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
  const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
  Touch t{0, 1};
  for (int k = 0; k < 3; ++k) {
    const double by = axes[k].by;
    if (by == 0) {
      if (lower[k] <= axes[k].upper && axes[k].lower <= upper[k]) continue;
      return {1, 0};
    }
    double first = (double{lower[k]} - double{axes[k].upper}) / by;
    double last = (double{upper[k]} - double{axes[k].lower}) / by;
    if (by < 0) std::swap(first, last);
    if (first > t.enter) t.enter = first;  // a NaN is no bound
    if (last < t.leave) t.leave = last;
  }
  return t;
}

Cover::Cover(const Sweep& sweep) noexcept {
  SweepAxis axes[3];
  axes_of(sweep, axes);
  for (int k = 0; k < 3; ++k) {
    by_[k] = axes[k].by;
    const auto slack = [&](double x) {
      return std::isfinite(x) ? (std::fabs(x) + std::fabs(by_[k])) * 0x1p-40 : 0.0;
    };
    lower_[k] = axes[k].lower - slack(axes[k].lower);
    upper_[k] = axes[k].upper + slack(axes[k].upper);
  }
}

}  // namespace throng::live
