// Boxes with lower > upper where they are refused: finds them and guesses the intended layout.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/boxes.hpp>
#include <throng/options.hpp>

#include "base/bounds.hpp"
#include "validate.hpp"

namespace throng {

// Counts how many boxes are valid as given, and how many would be under each likely mistake.
class LayoutGuess {
 public:
  // Lower x, y, z, upper x, y, z as given, no NaN; 2-D boxes have both z 0.
  void add(const double (&given)[6], bool flat) noexcept;
  // The layout that fits nearly all boxes, with the fix, or null: "lower and upper look swapped".
  const char* text() const noexcept;

 private:
  std::uint64_t count_ = 0, valid_ = 0, swapped_ = 0, sizes_ = 0, intervals_ = 0;
};

// Sets status and message for r.invalid_count of `count` boxes; `set`: "", " of the first set".
// Returns false.
bool refuse_inverted(const LayoutGuess& guess, std::size_t count, const char* set,
                     Result& r) noexcept;

// Returns whether no box selected by selected(i) has lower > upper on some axis; if false, sets
// status and message. Boxes with a NaN are skipped.
template <class Real, class Selected>
bool check_not_inverted(const BasicBoxes<Real>& boxes, const char* set, const Selected& selected,
                        Result& r) noexcept {
  const std::size_t n = boxes.size();
  for (std::size_t i = 0; i < n; ++i) {
    const auto box = boxes[i];
    if (base::is_active(box) || base::has_nan(box) || !selected(i)) continue;
    if (r.invalid_count++ == 0) r.first_invalid = i;
  }
  if (r.invalid_count == 0) return true;
  LayoutGuess guess;
  for (std::size_t i = 0; i < n; ++i) {
    if (base::has_nan(boxes[i]) || !selected(i)) continue;
    double given[6];
    for (int k = 0; k < 6; ++k) given[k] = double{boxes.corner(i, k)};
    guess.add(given, boxes.is_flat());
  }
  return refuse_inverted(guess, n, set, r);
}
inline constexpr auto all_boxes = [](std::size_t) { return true; };

// The same for all boxes of one set, or of two if b is not null.
template <class AnyBoxes>
bool check_not_inverted(const AnyBoxes& a, const AnyBoxes* b, Result& r) noexcept {
  if (!b) return check_not_inverted(a, "", all_boxes, r);
  return check_not_inverted(a, " of the first set", all_boxes, r) &&
         check_not_inverted(*b, " of the second set", all_boxes, r);
}

}  // namespace throng
