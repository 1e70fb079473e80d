// Swept boxes: the time of contact with another box, and bounds of the path.
#pragma once

#include <cmath>
#include <cstddef>

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>

#include "base/bounds.hpp"
#include "base/host_device_macros.hpp"

namespace throng::base {

THRONG_HD constexpr bool is_finite(double x) noexcept { return x - x == 0; }

// A valid query: no NaN and a finite displacement.
THRONG_HD constexpr bool is_valid_sweep(const Sweep& s) noexcept {
  return is_finite(s.by.x) && is_finite(s.by.y) && is_finite(s.by.z) && !has_nan(s.box);
}

// The boxes at the start of the sweeps, with the given filters.
inline Boxes boxes_of(const Sweep* sweeps, std::size_t count, const Filters& filters) noexcept {
  Boxes boxes(sweeps ? &sweeps->box : nullptr, count, sizeof(Sweep));
  boxes.filters = filters;
  return boxes;
}

// A sweep with its displacement in doubles, which may exceed the range of floats: that of a Sweep,
// or of a ray (ray.hpp).
struct MovingBox {
  Box box;
  double by[3];

  MovingBox() noexcept = default;
  THRONG_HD explicit MovingBox(const Sweep& s) noexcept : box(s.box), by{s.by.x, s.by.y, s.by.z} {}
  MovingBox(const Box& start, double x, double y, double z) noexcept : box(start), by{x, y, z} {}

  // Whether it moves further than from the lowest float to the highest.
  bool exceeds_floats() const noexcept {
    constexpr double most = 0x1p129;
    return fabs(by[0]) > most || fabs(by[1]) > most || fabs(by[2]) > most;
  }
};

struct SweepAxis {
  float lower, upper, by;
};
THRONG_HD inline void axes_of(const Sweep& s, SweepAxis (&axes)[3]) noexcept {
  axes[0] = {s.box.lower.x, s.box.upper.x, s.by.x};
  axes[1] = {s.box.lower.y, s.box.upper.y, s.by.y};
  axes[2] = {s.box.lower.z, s.box.upper.z, s.by.z};
}

// The time interval in which a moving box touches another: `enter` .. `leave`, if enter <= leave.
// Differences of floats in doubles, divided by a displacement between 2^-500 and 2^500, neither
// overflow nor produce NaN, except where two infinite bounds meet: those boxes touch from the start
// on that axis.
struct ContactInterval {
  double enter, leave;
};
THRONG_HD inline ContactInterval contact_interval(const MovingBox& sweep, const Box& b) noexcept {
  const float start_lower[3] = {sweep.box.lower.x, sweep.box.lower.y, sweep.box.lower.z};
  const float start_upper[3] = {sweep.box.upper.x, sweep.box.upper.y, sweep.box.upper.z};
  const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
  const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
  ContactInterval t{0, 1};
  for (int k = 0; k < 3; ++k) {
    const double by = sweep.by[k];
    if (by == 0) {
      if (lower[k] <= start_upper[k] && start_lower[k] <= upper[k]) continue;
      return {1, 0};
    }
    const double at_lower = (double{lower[k]} - double{start_upper[k]}) / by;
    const double at_upper = (double{upper[k]} - double{start_lower[k]}) / by;
    const double first = by < 0 ? at_upper : at_lower, last = by < 0 ? at_lower : at_upper;
    if (first > t.enter) t.enter = first;  // false for a NaN
    if (last < t.leave) t.leave = last;
  }
  return t;
}
THRONG_HD inline ContactInterval contact_interval(const Sweep& sweep, const Box& b) noexcept {
  return contact_interval(MovingBox(sweep), b);
}

// Conservative bounds of a sweep between two times in 0 .. 1. Every contact that contact_interval()
// reports in the interval overlaps this box: the slack exceeds the rounding errors.
//
// Until time `end` contact_interval() errs by about 2^-51 of its operands: the bounds, and the
// distance covered by then, |by| * end. Each bound moves outward by 2^-40 of their sum. So a sweep
// far longer than the scene is bounded as tightly as a short one. Conversion to float errs by 2^-24
// of the bound, or 2^-150; the bound moves outward by 2^-22 of itself and 2^-140. A bound that
// holds until some time holds until any earlier time.
class SweptBounds {
 public:
  SweptBounds() noexcept = default;
  THRONG_HD explicit SweptBounds(const MovingBox& sweep) noexcept
      : lower_{sweep.box.lower.x, sweep.box.lower.y, sweep.box.lower.z},
        upper_{sweep.box.upper.x, sweep.box.upper.y, sweep.box.upper.z},
        by_{sweep.by[0], sweep.by[1], sweep.by[2]} {}
  THRONG_HD explicit SweptBounds(const Sweep& sweep) noexcept : SweptBounds(MovingBox(sweep)) {}
  THRONG_HD Box operator()(double begin, double end) const noexcept {
    float lower[3], upper[3];
    for (int k = 0; k < 3; ++k) {
      const double a = by_[k] * begin, b = by_[k] * end;
      lower[k] = below(this->lower(k, end) + (a < b ? a : b));
      upper[k] = -below(-this->upper(k, end) - (a < b ? b : a));
    }
    return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}};
  }
  // Along an axis: the start bounds in doubles, with slack valid until `end`; and the displacement.
  THRONG_HD double lower(int k, double end) const noexcept {
    return lower_[k] - slack(lower_[k], by_[k] * end);
  }
  THRONG_HD double upper(int k, double end) const noexcept {
    return upper_[k] + slack(upper_[k], by_[k] * end);
  }
  double by(int k) const noexcept { return by_[k]; }

 private:
  THRONG_HD static double slack(double x, double way) noexcept {
    return is_finite(x) ? (fabs(x) + fabs(way)) * 0x1p-40 : 0.0;
  }
  THRONG_HD static float below(double x) noexcept {
    const double out = x - fabs(x) * 0x1p-22 - 0x1p-140;
    return static_cast<float>(out < x ? out : x);  // an infinity stays
  }

  double lower_[3] = {}, upper_[3] = {}, by_[3] = {};
};

}  // namespace throng::base
