#include "inverted_boxes.hpp"

namespace throng {

void LayoutGuess::add(const double (&given)[6], bool flat) noexcept {
  const auto ordered = [&](int lower, int upper) { return given[lower] <= given[upper]; };
  ++count_;
  valid_ += ordered(0, 3) && ordered(1, 4) && ordered(2, 5);
  swapped_ += ordered(3, 0) && ordered(4, 1) && ordered(5, 2);
  sizes_ += given[3] >= 0 && given[4] >= 0 && given[5] >= 0;
  // The order x min, x max, y min, y max, ...; for 2-D boxes the four given values.
  intervals_ += ordered(0, 1) && (flat ? ordered(3, 4) : ordered(2, 3) && ordered(4, 5));
}

// At most 74 characters each, so that the message keeps its fix whatever its numbers.
const char* LayoutGuess::text() const noexcept {
  const auto fits = [&](std::uint64_t boxes) { return boxes >= count_ - count_ / 20; };
  if (fits(valid_)) return nullptr;  // only some boxes are inverted: not a layout mistake
  if (fits(intervals_))
    return "the order looks like xmin, xmax, ymin, ...: give all lower bounds first";
  // In an all-positive scene every upper corner could be a size.
  const bool sizes = fits(sizes_) && valid_ < count_ / 2 + 1;
  if (sizes && fits(swapped_))
    return "upper looks like a size: box_from_center(center, size / 2); or swapped";
  if (sizes) return "upper looks like a size: use box_from_center(center, size / 2)";
  if (fits(swapped_)) return "lower and upper look swapped";
  return nullptr;
}

bool refuse_inverted(const LayoutGuess& guess, std::size_t count, const char* set,
                     Result& r) noexcept {
  const char* const cause = guess.text();
  using ull = unsigned long long;
  set_message(
      r,
      "%llu of %llu boxes%s have lower > upper, the first is box %llu%s%s; for empty slots set "
      "Options::inverted to inactive",
      ull{r.invalid_count}, ull{count}, set, ull{r.first_invalid}, cause ? ": " : "",
      cause ? cause : "");
  return refuse(r, Status::inverted_box);
}

}  // namespace throng
