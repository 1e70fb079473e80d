// The interface of a family of scenes. Internal to scene/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "apps/scenes/random.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::scenes {

class Generator {
 public:
  virtual ~Generator() = default;
  virtual void boxes(std::size_t f, std::size_t begin, std::size_t end, Box* out) const = 0;
  virtual bool moves(std::size_t i) const noexcept = 0;
  virtual double side() const noexcept = 0;
  virtual bool has_worlds() const noexcept { return false; }
  virtual std::int32_t world(std::size_t) const noexcept { return -1; }
};

// Null if the family has no scene of that name. A density of 0 in the spec is resolved.
std::unique_ptr<Generator> make_scatter(Spec& spec);
std::unique_ptr<Generator> make_pile(Spec& spec);
std::unique_ptr<Generator> make_column(Spec& spec);

// The boxes that move: the share `moving` of them, the same in every frame.
class Movers {
 public:
  explicit Movers(double share) noexcept : limit_(static_cast<std::uint64_t>(share * 0x1p32)) {}
  bool operator()(std::uint64_t bits) const noexcept { return (bits & 0xffffffffu) < limit_; }

 private:
  std::uint64_t limit_;
};

// A box from its lower corner and its size, rounded once.
inline Box box_at(double x, double y, double z, double sx, double sy, double sz) noexcept {
  return {{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)},
          {static_cast<float>(x + sx), static_cast<float>(y + sy), static_cast<float>(z + sz)}};
}

// A box size, and its share of all boxes.
struct SizeClass {
  double size[3];
  double share;
};

// The probability that intervals of lengths a and b overlap, lower ends uniform in [0, span].
double meeting_chance(double a, double b, double span) noexcept;
// The expected pairs per box of n boxes, each size class alike, lower corners uniform in a cube.
double expected_pairs(const std::vector<SizeClass>& classes, std::size_t n, const double span[3]);
// The side of the cube that gives `pairs` per box; 0 where n boxes cannot have so many.
double solve_span(const std::vector<SizeClass>& classes, std::size_t n, double pairs);

// The smallest x with value(x) <= target; `value` does not increase.
template <class Function>
double solve_falling(Function value, double target) {
  double low = 0, high = 1;
  if (value(0.0) <= target) return 0;
  while (value(high) > target && high < 1e30) high *= 2;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (value(middle) > target ? low : high) = middle;
  }
  return high;
}

}  // namespace throng::scenes
