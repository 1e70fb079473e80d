// The grid of the paper: cells of equal size over a given environment. Each box is entered into
// every cell that it touches; each cell runs the brute force through the mapping on its list.
//
// No pair is lost. Per axis one function maps a float to its cell,
//   cell(x) = int(min(max((x - origin) * scale, 0), cells - 1)),
// scale > 0 and finite. Rounded to nearest, each operation is non-decreasing in x, so cell is, for
// every float but NaN: x - origin is never NaN (origin is finite), nor is infinity * scale, and
// points outside of the environment map to the cells at its border. A box is entered into
// cell(lower) .. cell(upper) on each axis. If a.lower <= b.upper and b.lower <= a.upper then
// cell(a.lower) <= cell(b.upper) and cell(b.lower) <= cell(a.upper): the two ranges intersect on
// each axis, and both boxes are in the cell max(cell(a.lower), cell(b.lower)). The size of the
// cells, and how well scale fits the environment, affects speed alone.
//
// No pair is reported twice. Two boxes may share many cells; exactly one of them is
// max(cell(a.lower), cell(b.lower)) on all three axes. This owner cell reports the pair; the others
// skip it.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "apps/paper/search.hpp"
#include "base/bounds.hpp"
#include "base/host_device_macros.hpp"
#include "device/atomic.hpp"

namespace throng::paper {

// cells - 1 must be a float, so that the clamp against it is exact.
inline constexpr std::uint32_t max_cells_per_axis = 1u << 22;

struct GridShape {
  float origin[3] = {0, 0, 0};
  float scale[3] = {1, 1, 1};  // cells per unit of length
  std::uint32_t cells[3] = {1, 1, 1};

  THRONG_HD constexpr std::uint64_t cell_count() const noexcept {
    return std::uint64_t{cells[0]} * cells[1] * cells[2];
  }
  THRONG_HD constexpr std::uint32_t cell(int axis, float x) const noexcept {
    const float last = static_cast<float>(cells[axis] - 1);
    float t = (x - origin[axis]) * scale[axis];
    t = t > 0.0f ? t : 0.0f;
    t = t < last ? t : last;
    return static_cast<std::uint32_t>(t);
  }
  THRONG_HD constexpr std::uint64_t index(std::uint32_t x, std::uint32_t y,
                                          std::uint32_t z) const noexcept {
    return (std::uint64_t{z} * cells[1] + y) * cells[0] + x;
  }
};

// The cells that a box touches, both ends included on each axis.
struct CellRange {
  std::uint32_t low[3], high[3];
};

// box active.
THRONG_HD constexpr CellRange cells_of(const GridShape& shape, const Box& box) noexcept {
  return {{shape.cell(0, box.lower.x), shape.cell(1, box.lower.y), shape.cell(2, box.lower.z)},
          {shape.cell(0, box.upper.x), shape.cell(1, box.upper.y), shape.cell(2, box.upper.z)}};
}

// visit(index) for each cell that the box touches; none for an inactive box.
template <class Visit>
THRONG_HD void for_each_cell(const GridShape& shape, const Box& box, const Visit& visit) {
  if (!base::is_active(box)) return;
  const CellRange range = cells_of(shape, box);
  for (std::uint32_t z = range.low[2]; z <= range.high[2]; ++z)
    for (std::uint32_t y = range.low[1]; y <= range.high[1]; ++y)
      for (std::uint32_t x = range.low[0]; x <= range.high[0]; ++x) visit(shape.index(x, y, z));
}

// The owner cell of the pair; both boxes active.
THRONG_HD constexpr std::uint64_t owner(const GridShape& shape, const Box& a,
                                        const Box& b) noexcept {
  const CellRange p = cells_of(shape, a), q = cells_of(shape, b);
  const auto later = [&](int axis) {
    return p.low[axis] > q.low[axis] ? p.low[axis] : q.low[axis];
  };
  return shape.index(later(0), later(1), later(2));
}

// ---- work of one thread
// --------------------------------------------------------------------------

// First pass over the objects: the number of entries of each cell.
struct CountEntries {
  GridShape shape;
  const Box* boxes;
  std::uint32_t* counts;

  struct Add {
    std::uint32_t* counts;
    THRONG_HD void operator()(std::uint64_t cell) const noexcept {
      device::fetch_add(counts + cell, 1u);
    }
  };
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    for_each_cell(shape, boxes[i], Add{counts});
  }
};

// Second pass: `starts` holds the begin of each cell's list; `counts` is decremented and gives the
// next position in it.
struct FillEntries {
  GridShape shape;
  const Box* boxes;
  const std::uint64_t* starts;
  std::uint32_t* counts;
  std::uint32_t* entries;

  struct Put {
    const FillEntries& fill;
    std::uint32_t object;
    THRONG_HD void operator()(std::uint64_t cell) const noexcept {
      const std::uint32_t left = device::fetch_add(fill.counts + cell, 0xffffffffu);  // minus one
      fill.entries[fill.starts[cell] + left - 1] = object;
    }
  };
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    for_each_cell(shape, boxes[i], Put{*this, static_cast<std::uint32_t>(i)});
  }
};

// The brute force in one cell, shared by `lanes` threads; this is number `lane`.
template <class Mapping>
struct SearchCell {
  GridShape shape;
  const Box* boxes;
  const std::uint64_t* starts;
  const std::uint32_t* entries;
  Mapping mapping;
  PairSink sink;

  THRONG_HD void operator()(std::uint64_t cell, std::uint32_t lane,
                            std::uint32_t lanes) const noexcept {
    const std::uint64_t begin = starts[cell];
    const std::uint64_t n = starts[cell + 1] - begin;
    if (n < 2) return;
    const std::uint64_t threads = Mapping::threads(n);
    for (std::uint64_t t = lane; t < threads; t += lanes) {
      Pair place{};
      if (!mapping(t, n, place)) continue;
      const std::uint32_t i = entries[begin + place.first], j = entries[begin + place.second];
      const Box a = boxes[i], b = boxes[j];
      if (!base::overlaps(a, b) || owner(shape, a, b) != cell) continue;
      sink(i < j ? Pair{i, j} : Pair{j, i});
    }
  }
};

// ---- the setup, once per environment
// -------------------------------------------------------------

// The box around all finite coordinates of the active boxes; a point at 0 where there is none.
Box environment_of(const Box* boxes, std::uint64_t n) noexcept;

// Cells for n objects in the environment, `per_cell` of them per cell on average. At most n /
// per_cell + 1 cells: see grid.cpp. per_cell > 0.
GridShape make_grid(const Box& environment, std::uint64_t n, double per_cell) noexcept;

}  // namespace throng::paper
