// A periodic domain, as in granular and molecular dynamics: a body that leaves on one side enters
// on the opposite side, and boxes touch across the boundary.
#include <throng/throng.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <random>
#include <tuple>
#include <vector>

#include "check.hpp"

namespace {

using Shift = std::array<int, 3>;

// One of each two opposite shifts: a pair across the left side is also a pair across the right.
constexpr std::array<Shift, 13> shifts = {{{1, 0, 0},
                                           {0, 1, 0},
                                           {0, 0, 1},
                                           {1, 1, 0},
                                           {1, -1, 0},
                                           {1, 0, 1},
                                           {1, 0, -1},
                                           {0, 1, 1},
                                           {0, 1, -1},
                                           {1, 1, 1},
                                           {1, 1, -1},
                                           {1, -1, 1},
                                           {1, -1, -1}}};

// Box `second`, moved by `shift` lengths of the domain, touches box `first`.
struct PeriodicPair {
  std::uint32_t first, second;
  Shift shift;
};

// Rounded outward, so that no touching pair is lost.
throng::Box moved(const throng::Box& box, const double (&lengths)[3], const Shift& shift) {
  const double lower[3] = {box.lower.x + shift[0] * lengths[0], box.lower.y + shift[1] * lengths[1],
                           box.lower.z + shift[2] * lengths[2]};
  const double upper[3] = {box.upper.x + shift[0] * lengths[0], box.upper.y + shift[1] * lengths[1],
                           box.upper.z + shift[2] * lengths[2]};
  return throng::round_outward(lower, upper);
}

bool overlap(const throng::Box& a, const throng::Box& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
         b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

throng::Box around(const std::vector<throng::Box>& boxes) {
  throng::Box all = boxes.front();
  for (const throng::Box& box : boxes) {
    all.lower = {std::min(all.lower.x, box.lower.x), std::min(all.lower.y, box.lower.y),
                 std::min(all.lower.z, box.lower.z)};
    all.upper = {std::max(all.upper.x, box.upper.x), std::max(all.upper.y, box.upper.y),
                 std::max(all.upper.z, box.upper.z)};
  }
  return all;
}

class PeriodicFinder {
 public:
  PeriodicFinder(double x, double y, double z) : lengths_{x, y, z} {}

  // snippet-begin: find
  // Box centers lie in the domain; no box is longer than the domain. Returns false on failure.
  bool find(const std::vector<throng::Box>& boxes) {
    pairs_.clear();
    if (boxes.empty()) return true;
    // Append images of the boxes: those that reach the boxes of the domain.
    boxes_ = boxes;
    image_of_.resize(boxes.size());
    std::iota(image_of_.begin(), image_of_.end(), 0);
    is_image_.assign(boxes.size(), 0);
    shift_.assign(boxes.size(), Shift{0, 0, 0});
    const throng::Box reach = around(boxes);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (const Shift& shift : shifts) {
        const throng::Box image = moved(boxes[i], lengths_, shift);
        if (!overlap(image, reach)) continue;
        boxes_.push_back(image);
        image_of_.push_back(static_cast<std::int32_t>(i));
        is_image_.push_back(1);
        shift_.push_back(shift);
      }
    }
    throng::Boxes view(boxes_);
    view.filters.is_static = {is_image_.data(), is_image_.size()};  // no pair of two images,
    view.filters.owner = {image_of_.data(), image_of_.size()};      // nor a box and its image
    const throng::Result result = finder_.find(view);
    if (!result.ok()) {
      std::fprintf(stderr, "%s\n", result.message);
      return false;
    }
    for (const throng::Pair pair : finder_.pairs()) {  // an image is always second
      const auto second = static_cast<std::uint32_t>(image_of_[pair.second]);
      pairs_.push_back({pair.first, second, shift_[pair.second]});
    }
    return true;
  }
  // snippet-end: find

  const std::vector<PeriodicPair>& pairs() const { return pairs_; }
  std::size_t image_count(const std::vector<throng::Box>& boxes) const {
    return boxes_.size() - boxes.size();
  }

 private:
  double lengths_[3];
  throng::Finder finder_;
  std::vector<throng::Box> boxes_;
  std::vector<std::int32_t> image_of_;
  std::vector<std::uint8_t> is_image_;
  std::vector<Shift> shift_;
  std::vector<PeriodicPair> pairs_;
};

// Ordered so that first < second, to compare lists.
using Row = std::tuple<std::uint32_t, std::uint32_t, Shift>;
Row row(std::uint32_t first, std::uint32_t second, const Shift& shift) {
  if (first < second) return {first, second, shift};
  return {second, first, {-shift[0], -shift[1], -shift[2]}};
}

// The reference: every two boxes and every shift of the second. Coordinates are multiples of 1/16,
// so all sums are exact.
std::vector<Row> plainly(const std::vector<throng::Box>& boxes, const double (&lengths)[3]) {
  std::vector<Row> rows;
  for (std::uint32_t a = 0; a < boxes.size(); ++a) {
    for (std::uint32_t b = a + 1; b < boxes.size(); ++b) {
      for (int s = 0; s < 27; ++s) {
        const Shift shift = {s % 3 - 1, s / 3 % 3 - 1, s / 9 - 1};
        if (overlap(boxes[a], moved(boxes[b], lengths, shift))) rows.push_back({a, b, shift});
      }
    }
  }
  return rows;
}

// Boxes of up to longest / 16 per side, with centers in a domain of the given length.
std::vector<throng::Box> some(std::size_t count, int length, unsigned longest, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<throng::Box> boxes(count);
  for (throng::Box& box : boxes) {
    float center[3], half[3];
    for (int k = 0; k < 3; ++k) {
      center[k] = static_cast<float>(random() % static_cast<unsigned>(16 * length)) / 16;
      half[k] = static_cast<float>(random() % (longest / 2 + 1)) / 16;
    }
    box = {{center[0] - half[0], center[1] - half[1], center[2] - half[2]},
           {center[0] + half[0], center[1] + half[1], center[2] + half[2]}};
  }
  return boxes;
}

std::size_t pairs_across(const std::vector<throng::Box>& boxes, int length) {
  const double lengths[3] = {double(length), double(length), double(length)};
  PeriodicFinder finder(length, length, length);
  CHECK(finder.find(boxes));
  std::vector<Row> rows;
  std::size_t across = 0;
  for (const PeriodicPair& pair : finder.pairs()) {
    rows.push_back(row(pair.first, pair.second, pair.shift));
    across += pair.shift != Shift{0, 0, 0};
  }
  std::sort(rows.begin(), rows.end());
  std::vector<Row> wanted = plainly(boxes, lengths);
  std::sort(wanted.begin(), wanted.end());
  CHECK(rows == wanted);
  return across;
}

}  // namespace

int main() {
  // Across sides, edges and corners; boxes as long as the domain touch several times.
  CHECK(pairs_across(some(1000, 8, 20, 1), 8) > 100);
  CHECK(pairs_across(some(60, 2, 32, 2), 2) > 1000);
  CHECK(pairs_across({}, 1) == 0);

  const std::vector<throng::Box> many = some(100000, 93, 32, 3);
  PeriodicFinder finder(93, 93, 93);
  CHECK(finder.find(many));
  std::printf("%zu boxes, %zu images of them, %zu pairs\n", many.size(), finder.image_count(many),
              finder.pairs().size());
}
