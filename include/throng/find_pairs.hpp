// find_pairs: all overlapping pairs in one call.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <stdexcept>
#include <vector>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

class THRONG_API Error : public std::runtime_error {
 public:
  explicit Error(const Result& result);
  Status status() const noexcept { return result_.status; }
  const Result& result() const noexcept { return result_; }

 private:
  Result result_;
};

// Returns all pairs of overlapping boxes, each once, first < second. Throws Error, also for a box
// with lower > upper unless Options::inverted is InvertedPolicy::inactive.
// Cost, here and below: O(n + pairs); see docs/how-to/choose.md, 'What each call costs'.
THRONG_API std::vector<Pair> find_pairs(const Boxes& boxes, const Options& options = {});
// Returns all pairs of a box of `a` and an overlapping box of `b`. Throws Error.
THRONG_API std::vector<Pair> find_pairs(const Boxes& a, const Boxes& b,
                                        const Options& options = {});

// The non-throwing forms: errors are reported in Result::status. The content of `out` is replaced.
THRONG_API Result find_pairs(const Boxes& boxes, std::vector<Pair>& out,
                             const Options& options = {}) noexcept;
THRONG_API Result find_pairs(const Boxes& a, const Boxes& b, std::vector<Pair>& out,
                             const Options& options = {}) noexcept;

// The same for boxes of doubles, compared exactly as doubles; see Finder.
THRONG_API std::vector<Pair> find_pairs(const DoubleBoxes& boxes, const Options& options = {});
THRONG_API std::vector<Pair> find_pairs(const DoubleBoxes& a, const DoubleBoxes& b,
                                        const Options& options = {});
THRONG_API Result find_pairs(const DoubleBoxes& boxes, std::vector<Pair>& out,
                             const Options& options = {}) noexcept;
THRONG_API Result find_pairs(const DoubleBoxes& a, const DoubleBoxes& b, std::vector<Pair>& out,
                             const Options& options = {}) noexcept;

// Returns the smallest float box that contains the double box: lower rounded down, upper rounded
// up.
THRONG_API Box round_outward(const double lower[3], const double upper[3]) noexcept;

// Returns the smallest float box that contains [center - half_size, center + half_size]. half_size
// is half of the full extent on each axis, >= 0.
THRONG_API Box box_from_center(const Vec3& center, const Vec3& half_size) noexcept;
// The same for `count` centers and half sizes. Returns a vector, since Boxes is a view.
THRONG_API std::vector<Box> boxes_from_center(const Vec3* centers, const Vec3* half_sizes,
                                              std::size_t count);

}  // namespace throng
