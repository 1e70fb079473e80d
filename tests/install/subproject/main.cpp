// A program like a game engine, built with flags that break code which relies on NaN and infinity.
// The special values are made from bits, since the compiler may assume here that there is no NaN.
#include <throng/throng.hpp>

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "../expect.hpp"

#if defined(__GNUC__) && !defined(__FAST_MATH__)
#error "build this consumer with -ffast-math"
#endif

namespace {

float of_bits(std::uint32_t bits) {
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace

int main() {
  const float nan = of_bits(0x7fc00000), infinity = of_bits(0x7f800000);
  const float minus_infinity = of_bits(0xff800000), tiny = of_bits(1), tiny_too = of_bits(2);
  for (const throng::Isa isa : {throng::Isa::automatic, throng::Isa::scalar}) {
    for (const throng::Algorithm algorithm :
         {throng::Algorithm::all_pairs, throng::Algorithm::grid}) {
      throng::Options options;
      options.isa = isa;
      options.algorithm = algorithm;
      // A row of cubes, each of which touches the next.
      std::vector<throng::Box> boxes(300);
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        const float x = static_cast<float>(i);
        boxes[i] = {{x, 0, 0}, {x + 1, 1, 1}};
      }
      std::vector<throng::Pair> pairs;
      EXPECT(throng::find_pairs(boxes, pairs, options).ok() && pairs.size() == 299);

      boxes[7].upper.z = nan;
      throng::Result result = throng::find_pairs(boxes, pairs, options);
      EXPECT(result.status == throng::Status::nan_box && result.first_invalid == 7);
      options.nan = throng::NanPolicy::inactive;
      result = throng::find_pairs(boxes, pairs, options);
      EXPECT(result.ok() && pairs.size() == 297 && result.inactive == 1);

      // An unbounded ground, below all boxes but the inactive one.
      boxes[8] = {{minus_infinity, minus_infinity, minus_infinity}, {infinity, infinity, 0}};
      EXPECT(throng::find_pairs(boxes, pairs, options).ok() && pairs.size() == 296 + 298);

      // Two points one denormal apart, and a third equal to the first.
      const throng::Box points[3] = {{{tiny, 0, 0}, {tiny, 0, 0}},
                                     {{tiny_too, 0, 0}, {tiny_too, 0, 0}},
                                     {{tiny, 0, 0}, {tiny, 0, 0}}};
      EXPECT(throng::find_pairs(throng::Boxes(points, 3), pairs, options).ok());
      EXPECT(pairs.size() == 1 && (pairs[0] == throng::Pair{0, 2}));
    }
  }
  // Rounded outward, since 0.1 is not a float.
  const double lower[3] = {0.1, -0.1, 0}, upper[3] = {0.1, -0.1, 0};
  const throng::Box box = throng::round_outward(lower, upper);
  EXPECT(static_cast<double>(box.lower.x) < 0.1 && static_cast<double>(box.upper.x) > 0.1);
  EXPECT(static_cast<double>(box.lower.y) < -0.1 && static_cast<double>(box.upper.y) > -0.1);
  std::puts("subproject: ok");
  return 0;
}
