// The exact box of a body in 113-bit arithmetic, by a method other than the library's: corners and
// points are rotated one by one with cross products instead of a matrix.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <throng/throng.hpp>

namespace throng::tests {

#if defined(__SIZEOF_FLOAT128__)
using Wide = __float128;
#else
using Wide = long double;  // 113 bits on ARM
#endif

inline Wide size_of(Wide x) { return x < 0 ? -x : x; }

struct WideVec {
  Wide k[3];
};
inline WideVec wide(const Vec3& v) { return {{Wide(v.x), Wide(v.y), Wide(v.z)}}; }
inline WideVec cross(const WideVec& a, const WideVec& b) {
  return {{a.k[1] * b.k[2] - a.k[2] * b.k[1], a.k[2] * b.k[0] - a.k[0] * b.k[2],
           a.k[0] * b.k[1] - a.k[1] * b.k[0]}};
}
// R v = v + 2 w (q x v) + 2 q x (q x v).
inline WideVec turned(const Quaternion& q, const WideVec& v) {
  const WideVec axis = wide({q.x, q.y, q.z}), once = cross(axis, v), twice = cross(axis, once);
  WideVec out;
  for (int i = 0; i < 3; ++i) out.k[i] = v.k[i] + 2 * Wide(q.w) * once.k[i] + 2 * twice.k[i];
  return out;
}

struct ExactBox {
  Wide low[3], high[3];
  Wide sum[3];  // bounds the magnitudes of the summands
};

// One finite body. Without points: low > high.
struct OneBody {
  Vec3 position{0, 0, 0};
  Quaternion rotation{};
  Vec3 displacement{0, 0, 0};
  Shape shape{};
  float margin = 0;
};
inline ExactBox exact_box(const OneBody& b, const std::vector<Vec3>& points = {}) {
  std::vector<WideVec> local;
  if (b.shape.kind == ShapeKind::convex) {
    for (std::uint32_t k = 0; k < b.shape.point_count; ++k)
      local.push_back(wide(points[b.shape.first_point + k]));
  } else {
    const WideVec c = wide(b.shape.center), h = wide(b.shape.half_extents);
    for (int corner = 0; corner < 8; ++corner) {
      WideVec v;
      for (int i = 0; i < 3; ++i) v.k[i] = corner >> i & 1 ? c.k[i] + h.k[i] : c.k[i] - h.k[i];
      local.push_back(v);
    }
  }
  const Wide q[4] = {Wide(b.rotation.x), Wide(b.rotation.y), Wide(b.rotation.z),
                     Wide(b.rotation.w)};
  // An upper bound of all entries of R and of the terms that form them.
  const Wide largest = 1 + 2 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const Wide r = Wide(b.shape.radius) + Wide(b.margin);
  const WideVec p = wide(b.position), d = wide(b.displacement);
  ExactBox exact;
  for (int i = 0; i < 3; ++i) {
    exact.low[i] = Wide(std::numeric_limits<double>::infinity());
    exact.high[i] = -exact.low[i];
    exact.sum[i] = size_of(p.k[i]) + size_of(d.k[i]) + r;
  }
  for (const WideVec& v : local) {
    const WideVec image = turned(b.rotation, v);
    const Wide reach = 4 * largest * (size_of(v.k[0]) + size_of(v.k[1]) + size_of(v.k[2]));
    for (int i = 0; i < 3; ++i) {
      const Wide start = p.k[i] + image.k[i], end = start + d.k[i];
      exact.low[i] = std::min(exact.low[i], std::min(start, end) - r);
      exact.high[i] = std::max(exact.high[i], std::max(start, end) + r);
      exact.sum[i] = std::max(exact.sum[i], size_of(p.k[i]) + size_of(d.k[i]) + r + reach);
    }
  }
  return exact;
}

// How many of the checked sides were the tightest float.
struct Tightness {
  std::size_t sides = 0, tightest = 0;
};

// Checks that `given`, a lower end, is not above `low`, and at most one float below the result of
// rounding low - 2^-45 sum down. The proven bound is 2^-48 of sums that `sum` bounds loosely. The
// reference's own error is 2^-110 of sum, far less than the library's outward step of 2^-49.
inline void expect_lower(float given, Wide low, Wide sum, Tightness& seen) {
  const Wide own_error = sum * Wide(0x1p-108);
  ASSERT_FALSE(std::isnan(given));
  const double as_double = static_cast<double>(given);
  ASSERT_LE(Wide(as_double), low + own_error)
      << std::hexfloat << given << " cuts off part of the body";
  const float above = std::nextafter(given, std::numeric_limits<float>::infinity());
  const float next = std::nextafter(above, std::numeric_limits<float>::infinity());
  ASSERT_TRUE(std::isinf(next) || Wide(static_cast<double>(next)) > low - sum * Wide(0x1p-45))
      << std::hexfloat << given << " is further out than " << static_cast<double>(low);
  ++seen.sides;
  seen.tightest += Wide(static_cast<double>(above)) > low;
}

inline void expect_tight(const Box& box, const ExactBox& exact, Tightness& seen) {
  const float lower[3] = {box.lower.x, box.lower.y, box.lower.z};
  const float upper[3] = {box.upper.x, box.upper.y, box.upper.z};
  for (int i = 0; i < 3; ++i) {
    SCOPED_TRACE("axis " + std::to_string(i));
    expect_lower(lower[i], exact.low[i], exact.sum[i], seen);
    expect_lower(-upper[i], -exact.high[i], exact.sum[i], seen);
    if (testing::Test::HasFatalFailure()) return;
  }
}

inline bool has_nan(const Box& b) {
  return std::isnan(b.lower.x) || std::isnan(b.lower.y) || std::isnan(b.lower.z) ||
         std::isnan(b.upper.x) || std::isnan(b.upper.y) || std::isnan(b.upper.z);
}

}  // namespace throng::tests
