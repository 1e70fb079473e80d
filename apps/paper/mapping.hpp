// How a thread computes its pair from its index alone: the paper's mappings, and exact ones.
//
// Each is a small object with
//   threads(n)                the number of threads for n objects
//   operator()(t, n, pair)    thread t's pair, 0-based, first < second; false: it has none
// The index t is also the position of the result in the output, so every mapping can be combined
// with every form of output. n <= max_objects.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "apps/paper/roots.hpp"
#include "base/host_device_macros.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {

// The radicand of formula (1) is (2n - 1)^2 at k = 0: it fits 63 bits up to this n.
inline constexpr std::uint64_t max_objects = 1518500250;

// Row a begins at this index, 1-based: the paper's S(a) = (a - 1)(2n - a)/2. Signed; the product is
// even, as a - 1 or 2n - a is. |a| <= 2n: the product stays below 2^63.
THRONG_HD constexpr std::int64_t first_index(std::int64_t a, std::int64_t n) noexcept {
  return (a - 1) * (2 * n - a) / 2;
}

// 4n^2 - 4n - 8k + 1, evaluated without larger intermediate values: (2n - 1)^2 - 8k.
THRONG_HD constexpr std::uint64_t exact_radicand(std::uint64_t k, std::uint64_t n) noexcept {
  return (2 * n - 1) * (2 * n - 1) - 8 * k;
}

// Where the radicand is computed: in integers, or in the root's own floating point.
enum class Radicand { integer, real };

// Formulas (1) and (2) of the paper, for any root, with or without its two repairs.
//
// Why the repairs are exact for a row that is off by one, given exact integers in (2). Let (a, b)
// be right, b = a + 1 + k - S(a), and S(a + 1) = S(a) + n - a.
//   Row a - 1 was found: (2) gives a + k - S(a - 1) = a + k - S(a) + n - a + 1 = n + (b - a) > n.
//     The first repair turns a - 1 into a, and b becomes a + (n + b - a) - n.
//   Row a + 1 was found: (2) gives a + 2 + k - S(a) - n + a = a + 1 + b - n <= a + 1, as b <= n.
//     The second repair sets b to n - ((a + 1) - (a + 1 + b - n)), then a + 1 to a.
// A right pair has a < b <= n and stays unchanged. A row that is off by two or more stays wrong.
template <class Root>
struct Formula {
  using Real = typename Root::Real;

  Root root{};
  bool repair = true;
  Radicand radicand = Radicand::integer;

  THRONG_HD static constexpr std::uint64_t threads(std::uint64_t n) noexcept {
    return base::pair_count(n);
  }

  // Formula (1): the row, 1-based, by this root.
  THRONG_HD std::int64_t row(std::uint64_t k, std::uint64_t n) const noexcept {
    Real x;
    if (radicand == Radicand::integer) {
      x = static_cast<Real>(exact_radicand(k, n));
    } else {
      const Real m = static_cast<Real>(n);
      x = Real{4} * m * m - Real{4} * m - Real{8} * static_cast<Real>(k) + Real{1};
      x = x > Real{0} ? x
                      : Real{0};  // cancellation can make it negative, and the root of that is NaN
    }
    // Truncated, not floored: where the error makes the row negative, both are wrong.
    return static_cast<std::int64_t>((static_cast<Real>(2 * n + 1) - root(x)) / Real{2});
  }

  THRONG_HD bool operator()(std::uint64_t k, std::uint64_t n, Pair& pair) const noexcept {
    const std::int64_t count = static_cast<std::int64_t>(n);
    std::int64_t a = row(k, n);
    std::int64_t b = a + 1 + (static_cast<std::int64_t>(k) - first_index(a, count));
    if (repair) {
      if (b > count) {
        a = a + 1;
        b = a + (b - count);
      }
      if (a >= b) {
        b = count - (a - b);
        a = a - 1;
      }
    }
    // A wrong row can name an object that does not exist; no thread may read it.
    if (a < 1 || a >= b || b > count) return false;
    pair = {static_cast<std::uint32_t>(a - 1), static_cast<std::uint32_t>(b - 1)};
    return true;
  }
};

// The paper's numbering by a root with an integer correction: exact for every n.
struct Exact {
  THRONG_HD static constexpr std::uint64_t threads(std::uint64_t n) noexcept {
    return base::pair_count(n);
  }
  THRONG_HD bool operator()(std::uint64_t k, std::uint64_t n, Pair& pair) const noexcept {
    pair = base::pair_of_row_index(k, n);
    return true;
  }
};

// The lazy mapping: all combinations of a row (except the last) and a column; more than half of the
// threads have no pair.
struct Lazy {
  THRONG_HD static constexpr std::uint64_t threads(std::uint64_t n) noexcept {
    return n == 0 ? 0 : n * (n - 1);
  }
  THRONG_HD bool operator()(std::uint64_t t, std::uint64_t n, Pair& pair) const noexcept {
    const std::uint64_t a = t / n, b = t % n;
    pair = {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)};
    return a < b;
  }
};

// A list of all pairs in the paper's order: 8 bytes per pair, and the time to read them.
struct Stored {
  const Pair* list = nullptr;

  THRONG_HD static constexpr std::uint64_t threads(std::uint64_t n) noexcept {
    return base::pair_count(n);
  }
  THRONG_HD bool operator()(std::uint64_t k, std::uint64_t, Pair& pair) const noexcept {
    pair = list[k];
    return true;
  }
};

// The triangle folded into a rectangle: no root. The pairs (i, j), i < j < n, are the cells (i, j -
// 1), diagonal included, of a triangle of n - 1 rows. A two-dimensional launch would not even need
// the division.
struct Fold {
  THRONG_HD static constexpr std::uint64_t threads(std::uint64_t n) noexcept {
    return base::pair_count(n);
  }
  THRONG_HD bool operator()(std::uint64_t t, std::uint64_t n, Pair& pair) const noexcept {
    const base::TileFold fold{static_cast<std::uint32_t>(n - 1)};
    const std::uint64_t width = fold.width(), row = t / width;
    const base::TileFold::Cell tile =
        fold.tile({static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(t - row * width)});
    pair = {tile.row, tile.column + 1};
    return true;
  }
};

}  // namespace throng::paper
