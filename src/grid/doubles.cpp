#include "grid/doubles.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace throng::grid {
namespace {

constexpr std::size_t most_samples = 64;  // per set

// Finite coordinates of sampled boxes.
struct Sample {
  std::size_t count = 0;
  double value[2 * most_samples] = {};

  void add(const DoubleBoxes& boxes, int axis) noexcept {
    const std::size_t step = std::max<std::size_t>(1, boxes.size() / most_samples);
    const std::size_t samples = std::min(boxes.size(), most_samples);
    for (std::size_t i = 0; i < samples; ++i) {
      const double x = boxes.corner(i * step, axis);
      value[count] = x;
      count += std::isfinite(x);
    }
  }
};

double origin_of(const Doubles& doubles, int axis) noexcept {
  Sample sample;
  sample.add(*doubles.a, axis);
  if (doubles.b != doubles.a) sample.add(*doubles.b, axis);
  if (sample.count == 0) return 0;
  std::sort(sample.value, sample.value + sample.count);
  const double middle = sample.value[sample.count / 2];
  const double spread = sample.value[sample.count * 3 / 4] - sample.value[sample.count / 4];
  // Near 0 the origin is 0: coordinates that are floats stay exact.
  constexpr double far = 4;
  return std::fabs(middle) > far * spread ? middle : 0;
}

Box rounded(const DoubleBox& box, const DoubleVec3& o) noexcept {
  return {{static_cast<float>(box.lower.x - o.x), static_cast<float>(box.lower.y - o.y),
           static_cast<float>(box.lower.z - o.z)},
          {static_cast<float>(box.upper.x - o.x), static_cast<float>(box.upper.y - o.y),
           static_cast<float>(box.upper.z - o.z)}};
}

// Rounds boxes begin .. end - 1 of box(i).
template <class BoxAt>
void round_to_floats(const BoxAt& box, const DoubleVec3& origin, float margin, std::size_t begin,
                     std::size_t end, Box* out) noexcept {
  for (std::size_t i = begin; i < end; ++i) {
    const DoubleBox given = box(i);
    out[i] = rounded(margin != 0 ? base::expand(given, margin) : given, origin);
    // A box may be inverted by less than float resolution, or turned around by a margin.
    if (!base::is_active(given) && !base::has_nan(given)) [[unlikely]]
      out[i] = {{1, 1, 1}, {0, 0, 0}};
  }
}

}  // namespace

DoubleVec3 choose_origin(const Doubles& doubles) noexcept {
  return {origin_of(doubles, 0), origin_of(doubles, 1), origin_of(doubles, 2)};
}

void round_to_floats(const DoubleBoxes& boxes, const DoubleVec3& origin, float margin,
                     const Executor& executor, unsigned tasks, Box* out) {
  constexpr std::size_t step = 512;
  base::ChunkQueue shares(boxes.size(), tasks, step);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) {
      if (const char* const packed = boxes.packed_data()) {
        const auto box = [packed, stride = boxes.stride_bytes()](std::size_t i) {
          DoubleBox b;
          std::memcpy(&b, packed + i * stride, sizeof b);
          return b;
        };
        margin != 0 ? round_to_floats(box, origin, margin, begin, end, out)
                    : round_to_floats(box, origin, 0, begin, end, out);
      } else {
        round_to_floats([&](std::size_t i) { return boxes[i]; }, origin, margin, begin, end, out);
      }
    }
  };
  base::run_tasks(executor, tasks, task);
}

}  // namespace throng::grid
