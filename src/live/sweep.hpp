// A box on its way: when it touches another one, and where it is meanwhile.
#pragma once

#include <throng/broad_phase.hpp>

namespace throng::live {

// When a moving box touches another one: from `enter` to `leave`, if enter <= leave.
struct Touch {
  double enter, leave;
};
Touch touch(const Sweep& sweep, const Box& box) noexcept;

struct SweepAxis {
  float lower, upper, by;
};
void axes_of(const Sweep& sweep, SweepAxis (&axes)[3]) noexcept;

// Boxes that hold where a sweep is from one time to another, both in 0 .. 1, and reach a little
// further, by more than arithmetic may have rounded: whatever touch() says is met between the two
// overlaps this box.
//
// touch() is off by some 2^-51 of the numbers that meet in it, for which a bound is put 2^-40 of
// them further out. And a bound is off by 2^-24 of itself, or 2^-150, as it becomes a float, for
// which it is put out by 2^-22 of itself and 2^-140.
class Cover {
 public:
  Cover() noexcept = default;
  explicit Cover(const Sweep& sweep) noexcept;
  Box operator()(double begin, double end) const noexcept {
    float lower[3], upper[3];
    for (int k = 0; k < 3; ++k) {
      const double a = by_[k] * begin, b = by_[k] * end;
      lower[k] = below(lower_[k] + (a < b ? a : b));
      upper[k] = -below(-upper_[k] - (a < b ? b : a));
    }
    return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}};
  }
  // Along an axis: its bounds at the start, not for floats, and how far it goes.
  double lower(int k) const noexcept { return lower_[k]; }
  double upper(int k) const noexcept { return upper_[k]; }
  double by(int k) const noexcept { return by_[k]; }

 private:
  static float below(double x) noexcept {
    const double out = x - (x < 0 ? -x : x) * 0x1p-22 - 0x1p-140;
    return static_cast<float>(out < x ? out : x);  // an infinite one stays
  }

  double lower_[3] = {}, upper_[3] = {}, by_[3] = {};
};

}  // namespace throng::live
