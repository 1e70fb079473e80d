// The paper's mapping between an index and a pair, in exact integers: how a thread, or a chunk of a
// triangle, turns a number into the two boxes to compare.
//
// Three numberings of the pairs (i, j), 0 <= i < j < n, all 0-based:
//   rows     k = i(2n - i - 1)/2 + (j - i - 1): row i holds (i, i+1) .. (i, n-1), row after row
//   columns  k = j(j - 1)/2 + i: independent of n
//   fold     tiles of a T x T triangle, diagonal included, as the cells of a rectangle: no root
//
// Domain: n <= 2^32, so every k < 2^31 (2^32 - 1) < 2^63.
#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"

namespace throng::base {

// m(m - 1)/2: the number of pairs of m items. Halving the even factor first means that only the
// result must fit: below 2^63 for m <= 2^32, below 2^64 for m <= 2^32 + 2.
THRONG_HD constexpr std::uint64_t pair_count(std::uint64_t m) noexcept {
  return m % 2 == 0 ? (m / 2) * (m - (m != 0)) : m * ((m - 1) / 2);
}

// A double near the square root of x = 2k + 1/4, for triangle_column() only. At compile time, where
// std::sqrt is not available, Newton's method from above; the iterates decrease until they reach
// the root.
THRONG_HD constexpr double approximate_root(double x) noexcept {
  if (!std::is_constant_evaluated()) return std::sqrt(x);
  double y = x < 1 ? 1 : x;
  for (double next = 0.5 * (y + x / y); next < y; next = 0.5 * (y + x / y)) y = next;
  return y;
}

// The column j of index k in the column numbering: the largest j with j(j - 1)/2 <= k. k < 2^63.
//
// In real numbers j = floor(r + 1/2), r = sqrt(2k + 1/4). Relative errors in doubles, in any
// rounding mode: converting k at most 2^-52, doubling 0, adding 1/4 2^-52, so the radicand slightly
// over 2^-51 and its root half of that; the root operation and adding 1/2 err by 2^-52 each (the
// compile-time root by a few more). r < 2^32 + 1, so the sum is off by less than 2^-16 and its
// floor by at most one: one step either way is enough. Integers decide the step: j <= 2^32 + 1
// here, and pair_count(2^32 + 2) < 2^64.
THRONG_HD constexpr std::uint64_t triangle_column(std::uint64_t k) noexcept {
  const double root = approximate_root(2.0 * static_cast<double>(k) + 0.25);
  // NOLINTNEXTLINE(bugprone-incorrect-roundings): a guess, corrected below
  std::uint64_t j = static_cast<std::uint64_t>(root + 0.5);
  if (pair_count(j) > k) return j - 1;
  return pair_count(j + 1) <= k ? j + 1 : j;
}

// ---- columns ------------------------------------------------------------------------------------

// i < j.
THRONG_HD constexpr std::uint64_t column_index(std::uint32_t i, std::uint32_t j) noexcept {
  return pair_count(j) + i;
}

THRONG_HD constexpr Pair pair_of_column_index(std::uint64_t k) noexcept {
  const std::uint64_t j = triangle_column(k);
  return {static_cast<std::uint32_t>(k - pair_count(j)), static_cast<std::uint32_t>(j)};
}

// ---- rows ---------------------------------------------------------------------------------------

// The index of the first pair of row i, (i, i + 1); for i = n - 1 the number of all pairs. 1 <= n,
// i <= n - 1. From row i on, the pairs are those among the last n - i items. Both terms are exact
// and the first is not smaller, so the difference cannot overflow.
THRONG_HD constexpr std::uint64_t row_start(std::uint64_t i, std::uint64_t n) noexcept {
  return pair_count(n) - pair_count(n - i);
}

// i < j < n.
THRONG_HD constexpr std::uint64_t row_index(std::uint32_t i, std::uint32_t j,
                                            std::uint64_t n) noexcept {
  return row_start(i, n) + (j - i - 1);
}

// The paper's mapping. k < n(n - 1)/2. Counted backwards from the last pair, rows are the columns
// of the other numbering, so one root serves both: pair (i, j) has the backward index
// column_index(n - 1 - j, n - 1 - i).
THRONG_HD constexpr Pair pair_of_row_index(std::uint64_t k, std::uint64_t n) noexcept {
  const Pair back = pair_of_column_index(pair_count(n) - 1 - k);
  return {static_cast<std::uint32_t>(n - 1 - back.second),
          static_cast<std::uint32_t>(n - 1 - back.first)};
}

// ---- fold ---------------------------------------------------------------------------------------

// The tiles (row, column), row <= column < tiles, laid out as a full rectangle: row r of the
// triangle and its complementary row share one row of the rectangle. Even and odd numbers of tiles
// fold differently. No product is formed, and width <= tiles + 1 fits for tiles < 2^32 - 1.
struct TileFold {
  std::uint32_t tiles = 0;

  struct Cell {
    std::uint32_t row, column;
    friend constexpr bool operator==(Cell, Cell) noexcept = default;
  };

  THRONG_HD constexpr std::uint32_t width() const noexcept {
    return tiles % 2 == 0 ? tiles + 1 : tiles;
  }
  THRONG_HD constexpr std::uint32_t height() const noexcept { return tiles / 2 + tiles % 2; }

  // The tile at (row, column) of the rectangle.
  THRONG_HD constexpr Cell tile(Cell cell) const noexcept {
    if (cell.column < tiles - cell.row) return {cell.row, cell.row + cell.column};
    if (tiles % 2 == 0) return {tiles - 1 - cell.row, cell.column - 1};
    return {tiles - cell.row, cell.column};
  }

  // The inverse: the rectangle cell of a tile of the triangle.
  THRONG_HD constexpr Cell cell(Cell tile) const noexcept {
    if (tile.row < height()) return {tile.row, tile.column - tile.row};
    if (tiles % 2 == 0) return {tiles - 1 - tile.row, tile.column + 1};
    return {tiles - tile.row, tile.column};
  }
};

}  // namespace throng::base
