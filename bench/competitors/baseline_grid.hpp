// The grid that both baselines share: a good implementation without the library's refinements.
// Boxes are split into at most six size classes. Each class has its own uniform grid and is
// counting-sorted by the cell of the lower corner, x fastest. A box is tested against half of its
// neighbour cells in its own class (five ranges of memory) and against the cells in reach of every
// coarser class. The few boxes about as large as the scene are tested against all others.
//
// No touching pair is lost. A cell is at least as long as the largest extent of its class, widened
// so that rounding cannot place x and x + extent more than one cell apart. Clamping to the grid is
// monotone. The comparison of the floats decides.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <vector>

#include "method.hpp"
#include "thread_pool.hpp"

namespace throng::bench {

inline float corner(const Box& b, int k) { return (&b.lower.x)[k]; }
inline float extent(const Box& b) {
  return std::max({b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z});
}

// Records: how sorted boxes are stored and how one is compared with a range of others, and the
// best number of cells per box for that.
//   resize(n), prefetch(slot), put(slot, box, id), arrange(begin, end) once all are put,
//   query(slot), scan(query, begin, end, out) -> new out
template <class Records>
class BaselineGrid : public Method {
 public:
  explicit BaselineGrid(unsigned threads) : pool_(threads), out_(pool_.size()) {}

  void run(const Input& in) override {
    const std::size_t n = in.count;
    for (PairBuffer& out : out_) out.clear();
    if (n < 2) return;
    plan(in);
    sort(in);
    next_row_ = 0;
    pool_.run([&](unsigned t) { search(out_[t]); });
  }

  void collect(const Input&, std::vector<Pair>& all) const override {
    for (const PairBuffer& out : out_) all.insert(all.end(), out.begin(), out.end());
  }

 private:
  struct Level {
    float largest;           // extents up to this
    float inverse[3];        // 1 / cell size
    float top[3];            // index of the last cell
    std::uint32_t cells[3];  // including an empty one on each side: a neighbour always exists
    std::uint32_t first;     // index of its first cell in start_
    std::size_t rows, first_row;
    std::uint32_t count;  // boxes
  };
  static constexpr std::size_t max_levels = 6;
  static constexpr float level_ratio = 4.0f;

  std::uint32_t cell(const Level& l, float x, int axis) const {
    const float t = (x - origin_[axis]) * l.inverse[axis];
    return static_cast<std::uint32_t>(std::min(std::max(t, 0.0f), l.top[axis])) + 1;
  }

  // Range and sizes from a sample; the largest ordinary extent from all boxes.
  void plan(const Input& in) {
    const std::size_t n = in.count, step = (n + 1023) / 1024;
    float low[3], high[3];
    std::fill_n(low, 3, INFINITY);
    std::fill_n(high, 3, -INFINITY);
    sizes_.clear();
    for (std::size_t i = 0; i < n; i += step) {
      const Box& b = in.boxes[i];
      for (int k = 0; k < 3; ++k) {
        if (!std::isfinite(corner(b, k))) continue;
        low[k] = std::min(low[k], corner(b, k));
        high[k] = std::max(high[k], corner(b, k));
      }
      sizes_.push_back(extent(b));
    }
    float range[3], widest = 0;
    for (int k = 0; k < 3; ++k) {
      range[k] = high[k] >= low[k] ? high[k] - low[k] : 0;
      origin_[k] = high[k] >= low[k] ? low[k] : 0;
      widest = std::max(widest, range[k]);
    }
    const float ordinary = widest / 4;
    largest_of_.assign(pool_.size(), {0, 0, 0});
    pool_.run([&](unsigned t) {
      Vec3 m{0, 0, 0};
      for (std::size_t i = ThreadPool::part(n, t, pool_.size());
           i < ThreadPool::part(n, t + 1, pool_.size()); ++i) {
        const Box& b = in.boxes[i];
        const float x = b.upper.x - b.lower.x, y = b.upper.y - b.lower.y, z = b.upper.z - b.lower.z;
        const bool is_ordinary = std::max({x, y, z}) <= ordinary;
        m = {std::max(m.x, is_ordinary ? x : 0), std::max(m.y, is_ordinary ? y : 0),
             std::max(m.z, is_ordinary ? z : 0)};
      }
      largest_of_[t] = m;
    });
    float largest[3] = {0, 0, 0};
    for (const Vec3& m : largest_of_)
      for (int k = 0; k < 3; ++k) largest[k] = std::max(largest[k], (&m.x)[k]);
    const float top = std::max({largest[0], largest[1], largest[2]});

    std::sort(sizes_.begin(), sizes_.end());
    const float small = sizes_[sizes_.size() / 20];
    std::size_t levels = 1;
    for (float s = top / level_ratio; s > small && levels < max_levels; s /= level_ratio) ++levels;
    levels_.assign(levels, {});
    float limit = top;
    for (std::size_t j = levels; j-- > 0; limit /= level_ratio) levels_[j].largest = limit;
    std::uint32_t cells = 0;
    std::size_t rows = 0, below = 0;
    for (Level& l : levels_) {
      const std::size_t upto =
          std::upper_bound(sizes_.begin(), sizes_.end(), l.largest) - sizes_.begin();
      shape(l, range, largest, std::max<std::size_t>(1, (upto - below) * step));
      below = upto;
      l.first = cells;
      l.first_row = rows;
      l.rows = std::size_t{l.cells[1] - 2} * (l.cells[2] - 2);
      cells += l.cells[0] * l.cells[1] * l.cells[2];
      rows += l.rows;
    }
    cells_ = cells + 1;  // the last cell holds the huge boxes
    rows_ = rows;
  }

  // Cells as small as the extents allow, but not many more than boxes.
  void shape(Level& l, const float* range, const float* largest, std::size_t boxes) {
    float size[3];
    for (int k = 0; k < 3; ++k)
      size[k] = std::max({std::min(l.largest, largest[k]), range[k] / 60000, 1e-30f});
    for (;;) {
      double total = 1;
      for (int k = 0; k < 3; ++k) total *= std::floor(double(range[k]) / size[k]) + 1;
      if (total <= Records::cells_per_box * double(boxes) + 1) break;
      for (float& s : size) s *= 1.1f;
    }
    for (int k = 0; k < 3; ++k) {
      const double count = std::floor(double(range[k]) / size[k]) + 1;
      // Eight rounding errors per cell: difference, inverse and product have fewer in total.
      const double wide = double(size[k]) * (1 + 8.0 / 16777216 * (count + 2));
      l.inverse[k] = static_cast<float>(1 / wide);
      l.top[k] = static_cast<float>(count - 1);
      l.cells[k] = static_cast<std::uint32_t>(count) + 2;
    }
  }

  std::uint32_t key(const Box& b) const {
    const float e = extent(b);
    for (const Level& l : levels_)
      if (e <= l.largest)
        return l.first + (cell(l, b.lower.z, 2) * l.cells[1] + cell(l, b.lower.y, 1)) * l.cells[0] +
               cell(l, b.lower.x, 0);
    return cells_ - 1;
  }

  // A counting sort by cell, one histogram per thread.
  void sort(const Input& in) {
    const std::size_t n = in.count;
    const unsigned threads = pool_.size();
    keys_.resize(n);
    start_.resize(cells_ + 1);
    histogram_.resize(std::size_t{cells_} * threads);
    records_.resize(n);
    sums_.assign(threads + 1, 0);
    pool_.run([&](unsigned t) {
      std::uint32_t* h = histogram_.data() + std::size_t{cells_} * t;
      std::fill_n(h, cells_, 0u);
      for (std::size_t i = ThreadPool::part(n, t, threads); i < ThreadPool::part(n, t + 1, threads);
           ++i)
        ++h[keys_[i] = key(in.boxes[i])];
    });
    // Where each thread's part of each cell begins.
    const std::uint32_t* counts = histogram_.data();
    pool_.run([&](unsigned t) {
      std::uint32_t sum = 0;
      for (unsigned u = 0; threads > 1 && u < threads; ++u)
        for (std::size_t c = ThreadPool::part(cells_, t, threads);
             c < ThreadPool::part(cells_, t + 1, threads); ++c)
          sum += counts[std::size_t{cells_} * u + c];
      sums_[t + 1] = sum;
    });
    for (unsigned t = 0; t < threads; ++t) sums_[t + 1] += sums_[t];
    pool_.run([&](unsigned t) {
      std::uint32_t at = sums_[t], *h = histogram_.data(), *start = start_.data();
      const std::size_t cells = cells_, end = ThreadPool::part(cells, t + 1, threads);
      for (std::size_t c = ThreadPool::part(cells, t, threads); c < end; ++c) {
        start[c] = at;
        for (std::size_t u = c; u < cells * threads; u += cells) {
          const std::uint32_t count = h[u];
          h[u] = at;
          at += count;
        }
      }
    });
    start_[cells_] = static_cast<std::uint32_t>(n);
    pool_.run([&](unsigned t) {
      std::uint32_t* h = histogram_.data() + std::size_t{cells_} * t;
      const std::size_t end = ThreadPool::part(n, t + 1, threads);
      for (std::size_t i = ThreadPool::part(n, t, threads); i < end; ++i) {
        // Prefetch the slots of later boxes: most are in no near cache.
        if (i + 32 < end) __builtin_prefetch(&h[keys_[i + 32]], 1);
        if (i + 16 < end) records_.prefetch(h[keys_[i + 16]]);
        records_.put(h[keys_[i]]++, in.boxes[i], static_cast<std::uint32_t>(i));
      }
    });
    pool_.run([&](unsigned t) {
      records_.arrange(ThreadPool::part(n, t, threads), ThreadPool::part(n, t + 1, threads));
    });
    for (Level& l : levels_) {
      const std::uint32_t end = l.first + l.cells[0] * l.cells[1] * l.cells[2];
      l.count = start_[end] - start_[l.first];
    }
  }

  void search(PairBuffer& out) {
    const std::size_t huge = start_[cells_ - 1], n = start_[cells_];
    const std::size_t total = rows_ + (n - huge);
    const std::size_t chunk = std::max<std::size_t>(1, rows_ / (pool_.size() * 32));
    for (;;) {
      const std::size_t first = next_row_.fetch_add(chunk, std::memory_order_relaxed);
      if (first >= total) return;
      for (std::size_t r = first; r < std::min(first + chunk, total); ++r) {
        if (r < rows_) {
          search_row(r, out);
        } else {
          const std::size_t h = huge + (r - rows_);
          scan(records_.query(h), 0, huge, out);
          scan(records_.query(h), h + 1, n, out);
        }
      }
    }
  }

  void scan(const typename Records::Query& q, std::size_t begin, std::size_t end, PairBuffer& out) {
    if (begin < end) out.advance_to(records_.scan(q, begin, end, out.reserve(end - begin + 16)));
  }

  void search_row(std::size_t r, PairBuffer& out) {
    std::size_t j = 0;
    while (j + 1 < levels_.size() && r >= levels_[j + 1].first_row) ++j;
    const Level& l = levels_[j];
    const std::uint32_t inner = l.cells[1] - 2;
    const std::uint32_t z = static_cast<std::uint32_t>((r - l.first_row) / inner) + 1;
    const std::uint32_t y = static_cast<std::uint32_t>((r - l.first_row) % inner) + 1;
    const std::uint32_t nx = l.cells[0], slab = nx * l.cells[1];
    const std::uint32_t row = l.first + z * slab + y * nx;
    const std::uint32_t* start = start_.data();
    if (start[row] == start[row + nx]) return;
    for (std::uint32_t c = row + 1; c < row + nx - 1; ++c) {
      const std::uint32_t begin = start[c], end = start[c + 1];
      if (begin == end) continue;
      // The next row, then three rows of the next slab; x - 1 to x + 1 in each.
      const std::uint32_t at[4] = {c + nx - 1, c + slab - nx - 1, c + slab - 1, c + slab + nx - 1};
      std::uint32_t from[4], to[4], most = start[c + 2] - begin;
      for (int k = 0; k < 4; ++k) {
        from[k] = start[at[k]];
        to[k] = start[at[k] + 3];
        most += to[k] - from[k];
      }
      const std::uint32_t own_end = start[c + 2];
      for (std::uint32_t i = begin; i < end; ++i) {
        const auto q = records_.query(i);
        Pair* p = out.reserve(most + 16);
        p = records_.scan(q, i + 1, own_end, p);
        for (int k = 0; k < 4; ++k) p = records_.scan(q, from[k], to[k], p);
        out.advance_to(p);
        for (std::size_t up = j + 1; up < levels_.size(); ++up)
          if (levels_[up].count) search_coarser(levels_[up], q, out);
      }
    }
  }

  // A box against a coarser class: lower corners from one cell below its own to its upper corner.
  void search_coarser(const Level& l, const typename Records::Query& q, PairBuffer& out) {
    std::uint32_t low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = cell(l, corner(q.box, k), k) - 1;
      high[k] = cell(l, corner(q.box, k + 3), k);
    }
    for (std::uint32_t z = low[2]; z <= high[2]; ++z)
      for (std::uint32_t y = low[1]; y <= high[1]; ++y) {
        const std::uint32_t row = l.first + (z * l.cells[1] + y) * l.cells[0];
        scan(q, start_[row + low[0]], start_[row + high[0] + 1], out);
      }
  }

  ThreadPool pool_;
  std::vector<PairBuffer> out_;
  std::vector<Vec3> largest_of_;
  std::vector<float> sizes_;
  std::vector<Level> levels_;
  float origin_[3] = {};
  std::uint32_t cells_ = 0;
  std::size_t rows_ = 0;
  std::vector<std::uint32_t> keys_, start_, histogram_, sums_;
  Records records_;
  std::atomic<std::size_t> next_row_{0};
};

}  // namespace throng::bench
