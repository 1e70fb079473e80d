// A heap: unit cubes in a column on a square foot, denser and broader below; positions are
// independent of ids. Boxes oscillate around their places.
#include <cmath>

#include "apps/scenes/generator.hpp"

namespace throng::scenes {
namespace {

// The shape. The share w of all boxes is below height t(w) = linear_share w + (1 - linear_share)
// w^2 of the whole; the breadth there is 1 - taper t of that of the foot. Boxes per volume go as 1
// / (t'(w) breadth^2): 2 at the foot, 1.2 at the top.
constexpr double linear_share = 0.5;
constexpr double taper = 0.25;
constexpr double height = 2;  // in breadths of the foot
constexpr double swing = 0.25;

double height_of(double w) noexcept { return (linear_share + (1 - linear_share) * w) * w; }
double share_below(double t) noexcept {
  if (t <= 0) return 0;
  if (t >= 1) return 1;
  return (std::sqrt(linear_share * linear_share + 4 * (1 - linear_share) * t) - linear_share) /
         (2 * (1 - linear_share));
}

// Expected pairs per box. Two boxes that overlap are at most a unit apart in height, where the
// breadth is nearly the same for both.
double pairs_of_foot(double foot, std::size_t n) noexcept {
  constexpr int steps = 1024;
  const double unit_height = foot > 0 ? 1 / (height * foot) : 2;
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const double t = height_of((k + 0.5) / steps);
    const double flat = meeting_chance(1, 1, foot * (1 - taper * t));
    sum += flat * flat * (share_below(t + unit_height) - share_below(t - unit_height)) / steps;
  }
  return n > 1 ? sum * static_cast<double>(n - 1) / 2 : 0;
}

class Pile : public Generator {
 public:
  Pile(const Spec& spec, const Random& random) : random_(random), movers_(spec.moving) {
    foot_ =
        solve_falling([&](double foot) { return pairs_of_foot(foot, spec.objects); }, spec.density);
  }

  void boxes(std::size_t f, std::size_t begin, std::size_t end, Box* out) const override {
    const double time = static_cast<double>(f);
    for (std::size_t i = begin; i < end; ++i, ++out) {
      const std::uint64_t xy = random_.word(i, 0), z = random_.word(i, 1);
      const double t = height_of(unit(z));
      const double breadth = foot_ * (1 - taper * t);
      double at[3] = {(unit(xy) - 0.5) * breadth, (unit_low(xy) - 0.5) * breadth,
                      t * height * foot_};
      if (f > 0 && movers_(z)) {
        std::uint64_t bits = random_.word(i, 2);
        for (int k = 0; k < 3; ++k, bits >>= 21) {
          // Oscillates over swing; frame 0 is at a random phase.
          const double start = static_cast<double>(bits & 0x3ff) * 0x1p-10 * swing;
          const double step = static_cast<double>(1 + (bits >> 10 & 0x3ff)) * 0x1p-10 * 0.05;
          at[k] += reflect(start + step * time, swing) - start;
        }
        if (at[2] < 0) at[2] = -at[2];
      }
      *out = box_at(at[0], at[1], at[2], 1, 1, 1);
    }
  }

  bool moves(std::size_t i) const noexcept override { return movers_(random_.word(i, 1)); }
  double side() const noexcept override { return height * foot_ + 1 + swing; }

 private:
  Random random_;
  Movers movers_;
  double foot_ = 0;
};

}  // namespace

std::unique_ptr<Generator> make_pile(Spec& spec) {
  if (spec.name != "pile") return nullptr;
  if (spec.density == 0) spec.density = 4.9;
  return std::make_unique<Pile>(spec, Random(spec.seed, 100));
}

}  // namespace throng::scenes
