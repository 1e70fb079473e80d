// Region queries on the columns of a grid after its search: the records stay as binned until the
// next search.
//
// Why no box is missed: a region and a box that overlap share a column on every axis, and in each
// column that both touch, neither's quantized lower end is above the other's upper end
// (base/quantize.hpp).
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "base/sse2.hpp"
#include "grid/bin/grid.hpp"
#include "grid/plan/planner.hpp"

namespace throng::grid {

class GridQuery {
 public:
  // The grid of the last search, with its plan. That search had one set and no columns per world.
  GridQuery(const BinnedGrid& grid, const GridPlan& plan) noexcept : grid_(grid), plan_(plan) {}

  // Calls f(id) for every box that overlaps the region, and for some others; some ids are repeated.
  // Exceptions of f propagate. Returns the number of columns and records visited.
  template <class F>
  std::uint64_t each(const Box& region, F&& f) const;

  // The number of columns that a region touches.
  std::uint64_t columns_in(const Box& region) const noexcept;
  // The number of columns between two points, maximum over the axes.
  std::uint32_t columns_between(const Vec3& a, const Vec3& b) const noexcept;
  // The cost of each() for a region of `columns` columns, in ns; only ratios matter.
  double cost(std::uint64_t columns) const noexcept {
    return record_ns * static_cast<double>(grid_.wide(0).size()) +
           static_cast<double>(columns) * (column_ns + record_ns * records_per_column());
  }

 private:
  static constexpr double column_ns = 60, record_ns = 1;
  double records_per_column() const noexcept {
    return static_cast<double>(grid_.record_bound()) / grid_.column_count();
  }
  // The quantized ends of a region.
  struct Ends {
    std::int32_t lower[3], upper[3];
  };
  Ends ends_of(const Box& region) const noexcept;

  // Tests which records of a column may overlap a region.
  class QuantizedRegion {
   public:
    QuantizedRegion(const Ends& ends, const std::int32_t (&column)[3]) noexcept;
    bool overlap(const Record& record) const noexcept;

   private:
#if defined(THRONG_SSE2)
    __m128i inverted_mask_, max_values_;
#else
    std::int32_t lower_[3], upper_[3];
#endif
  };

  const BinnedGrid& grid_;
  const GridPlan& plan_;
};

#if defined(THRONG_SSE2)

// The records' upper and the region's lower ends with all bits inverted, so that one comparison
// tests all six against their maximum.
inline GridQuery::QuantizedRegion::QuantizedRegion(const Ends& ends,
                                                   const std::int32_t (&column)[3]) noexcept {
  std::int16_t turned[8] = {0, 0, 0, -1, -1, -1, 0, 0}, most[8] = {};
  for (int k = 0; k < 3; ++k) {
    most[k] = static_cast<std::int16_t>(base::quantized_upper(ends.upper[k], column[k]));
    most[3 + k] = static_cast<std::int16_t>(~base::quantized_lower(ends.lower[k], column[k]));
  }
  inverted_mask_ = _mm_loadu_si128(reinterpret_cast<const __m128i*>(turned));
  max_values_ = _mm_loadu_si128(reinterpret_cast<const __m128i*>(most));
}

inline bool GridQuery::QuantizedRegion::overlap(const Record& record) const noexcept {
  const __m128i words = _mm_load_si128(reinterpret_cast<const __m128i*>(&record));
  const __m128i above = _mm_cmpgt_epi16(_mm_xor_si128(words, inverted_mask_), max_values_);
  return (_mm_movemask_epi8(above) & 0xfff) == 0;
}

#else

inline GridQuery::QuantizedRegion::QuantizedRegion(const Ends& ends,
                                                   const std::int32_t (&column)[3]) noexcept {
  for (int k = 0; k < 3; ++k) {
    lower_[k] = base::quantized_lower(ends.lower[k], column[k]);
    upper_[k] = base::quantized_upper(ends.upper[k], column[k]);
  }
}

inline bool GridQuery::QuantizedRegion::overlap(const Record& record) const noexcept {
  bool apart = false;
  for (int k = 0; k < 3; ++k) apart |= record.lower[k] > upper_[k] || record.upper[k] < lower_[k];
  return !apart;
}

#endif

inline GridQuery::Ends GridQuery::ends_of(const Box& region) const noexcept {
  const float lower[3] = {region.lower.x, region.lower.y, region.lower.z};
  const float upper[3] = {region.upper.x, region.upper.y, region.upper.z};
  Ends r;
  for (int k = 0; k < 3; ++k) {
    r.lower[k] = base::quantize(plan_.map, k, lower[k]);
    r.upper[k] = base::quantize(plan_.map, k, upper[k]);
  }
  return r;
}

inline std::uint64_t GridQuery::columns_in(const Box& region) const noexcept {
  const Ends r = ends_of(region);
  std::uint64_t count = 1;
  for (int k = 0; k < 3; ++k)
    count *=
        static_cast<std::uint64_t>(base::column_of(r.upper[k]) - base::column_of(r.lower[k]) + 1);
  return count;
}

inline std::uint32_t GridQuery::columns_between(const Vec3& a, const Vec3& b) const noexcept {
  const Ends r = ends_of({a, b});
  std::int32_t most = 0;
  for (int k = 0; k < 3; ++k)
    most = std::max(most, std::abs(base::column_of(r.upper[k]) - base::column_of(r.lower[k])));
  return static_cast<std::uint32_t>(most);
}

template <class F>
std::uint64_t GridQuery::each(const Box& region, F&& f) const {
  std::uint64_t visited = grid_.wide(0).size();
  const Ends r = ends_of(region);
  std::int32_t c[3];
  const auto first = [&](int k) { return base::column_of(r.lower[k]); };
  const auto last = [&](int k) { return base::column_of(r.upper[k]); };
  for (c[0] = first(0); c[0] <= last(0); ++c[0]) {
    for (c[1] = first(1); c[1] <= last(1); ++c[1]) {
      for (c[2] = first(2); c[2] <= last(2); ++c[2]) {
        std::uint32_t column = 0;
        for (int k = 0; k < 3; ++k)
          column += static_cast<std::uint32_t>(c[k]) * plan_.map.stride[k];
        const QuantizedRegion words(r, c);
        ++visited;
        grid_.each_record(column, 0, [&](const Record& record) {
          ++visited;
          if (words.overlap(record)) f(record.id);
        });
      }
    }
  }
  for (const WideBox& box : grid_.wide(0)) {
    bool apart = false;
    for (int k = 0; k < 3; ++k) apart |= box.lower[k] > r.upper[k] || box.upper[k] < r.lower[k];
    if (!apart) f(box.id);
  }
  return visited;
}

}  // namespace throng::grid
