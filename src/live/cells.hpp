// Cells by size classes, hashed: where objects lie that mostly stay. Each box is kept once, in the
// cell of its lower corner, and looked for with a handful of cache lines.
//
// One function per axis maps a float to a whole number of units, q(x) = int(clamp(x * scale)).
// Each step is non-decreasing in round-to-nearest, so q is, for every float but NaN, infinities
// included. A box is of the first class c whose span 16 << c is at least q(upper) - q(lower) on
// every axis; cells of that class are 32 << c units long, 16 << c
// where boxes are dense, and the box's home on an axis is q(lower) >> (bits + c), bits 5 or 4.
//
// Why no pair is lost: let box b of class c overlap box a. On every axis b.lower <= a.upper and
// a.lower <= b.upper, so q(b.lower) <= q(a.upper), and q(b.lower) >= q(b.upper) - span >=
// q(a.lower) - span. Shifting keeps the order: b's home is one of the cells
//   (q(a.lower) - span) >> (bits + c)  ..  q(a.upper) >> (bits + c),
// and a search of a looks into all of those, for every class in use. No float is widened.
//
// A cell is found by a hash of its class, world and numbers. Cells that fall on one another only
// cost comparisons of boxes. A search may see a box twice then; whoever searches marks what it saw.
#pragma once

#include <bit>
#include <cstdint>

#include <throng/types.hpp>

#include "cpu/packed_box.hpp"
#include "live/list.hpp"
#include "live/objects.hpp"

namespace throng::live {

class Cells {
 public:
  // Two boxes; where more fall on a cell the others are in a chain of full lines behind it. An
  // empty entry is all NaN, which overlaps nothing. entry[0].link: the next line of the chain, or
  // none; entry[1].link: how many boxes are in this one.
  struct alignas(64) Line {
    cpu::PackedBox entry[2];
  };

  explicit Cells(cpu::Memory& memory) noexcept : lines_(memory) {}

  // Empties the cells and measures the active objects for new ones.
  void plan(const Objects& objects);
  // Whether so many fit without a new plan.
  bool takes(std::size_t objects) const noexcept { return objects <= most_objects_; }

  std::uint32_t home_of(const Box& box, std::int32_t world) const noexcept;
  void insert(ObjectId id, const Box& box, std::uint32_t home) noexcept;
  void erase(ObjectId id, std::uint32_t home) noexcept;
  // Of one that stays in its home.
  void replace(ObjectId id, const Box& box, std::uint32_t home) noexcept;

  // What a search looks into: which worlds, beside that of the box itself.
  struct Worlds {
    std::int32_t own = -1;
    bool everywhere = false;  // those of world -1, too: there are such, and `own` is another
    bool all = false;         // every world: `own` is -1, and there are others
  };
  // How many lines a search looks at, but for chains. No more than there are.
  std::uint64_t expected_lines(const Box& box, Worlds worlds) const noexcept;

  // A search in three steps, so that memory can be asked for ahead: where to look, which brings the
  // cells nearer; what lies behind them nearer; and the search, which calls f(id) for every box
  // that overlaps this one, some of them several times, and returns how many were compared. What f
  // throws comes through: it may want memory.
  struct Reach {
    static constexpr std::uint32_t most = 40, room = 62;
    std::uint32_t count;  // above `most`: too many to list
    std::uint32_t homes[room];
  };
  void reach(const Box& box, Worlds worlds, Reach& reach) const noexcept;
  void prefetch_chains(const Reach& reach) const noexcept {
    if (reach.count > Reach::most) return;
    for (std::uint32_t k = 0; k < reach.count; ++k) {
      const std::uint32_t next = lines_[reach.homes[k]].entry[0].link;
      prefetch(next != none ? next : reach.homes[k]);
    }
  }
  template <class F>
  std::uint64_t search(const Box& box, Worlds worlds, Reach& reach, F&& f) const;
  void prefetch(std::uint32_t home) const noexcept { live::prefetch(&lines_[home]); }

  std::size_t line_count() const noexcept { return lines_.size(); }
  // A length in the units that cells are made of.
  double units(double length) const noexcept { return length * static_cast<double>(scale_); }

  void reserve_for(const Cells& other) { lines_.reserve(other.lines_.capacity()); }
  void copy(const Cells& other) noexcept;

 private:
  static constexpr int classes = 24;
  static constexpr int span_bits = 4;
  static constexpr float most_units = 0x1p28f;

  struct alignas(16) Range {
    std::int32_t lower[4], upper[4];  // the last of each is of no meaning
  };
  Range quantise(const Box& b) const noexcept {
    alignas(16) const float corner[8] = {b.lower.x, b.lower.y, b.lower.z, 0,
                                         b.upper.x, b.upper.y, b.upper.z, 0};
    alignas(16) std::int32_t q[8];
    for (int k = 0; k < 8; ++k) {  // two vectors
      float t = corner[k] * scale_;
      t = t > -most_units ? t : -most_units;
      t = t < most_units ? t : most_units;
      q[k] = static_cast<std::int32_t>(t);
    }
    return {{q[0], q[1], q[2], q[3]}, {q[4], q[5], q[6], q[7]}};
  }
  // `classes` for a box too wide for any: those share one chain.
  static int class_of(const Range& r) noexcept;
  // Homes of a row of cells, but for the number along x, which is added.
  std::uint32_t row(int c, std::int32_t world, std::int32_t y, std::int32_t z) const noexcept {
    std::uint32_t h = static_cast<std::uint32_t>(world + 1) * 0xc2b2ae3du;
    h = (h ^ static_cast<std::uint32_t>(c)) * 0x9e3779b1u;
    h = mixed(h ^ static_cast<std::uint32_t>(y));
    return mixed(h ^ static_cast<std::uint32_t>(z));
  }
  static std::uint32_t mixed(std::uint32_t h) noexcept {
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
  }
  std::uint32_t wide_home() const noexcept { return mask_ + 1; }
  Range cells_of(const Range& r, int c) const noexcept {
    Range cells;
    for (int k = 0; k < 4; ++k) {
      cells.lower[k] = (r.lower[k] - (1 << (span_bits + c))) >> (cell_bits_ + c);
      cells.upper[k] = r.upper[k] >> (cell_bits_ + c);
    }
    return cells;
  }
  void count_class(int c, int one) noexcept {
    class_count_[c] += static_cast<std::size_t>(one);
    const std::uint32_t bit = 1u << c;
    used_ = class_count_[c] != 0 ? used_ | bit : used_ & ~bit;
    used_ &= (1u << classes) - 1;
  }
  template <class F>
  void each_home(const Box& box, Worlds worlds, F&& f) const;
  template <class F>
  void each_home(const Range& range, int c, std::int32_t world, F&& f) const;
  template <class F>
  std::uint64_t look(const cpu::PackedQuery& query, std::uint32_t home, F&& f) const;

  List<Line> lines_;
  std::uint32_t mask_ = 0;        // cells - 1, a power of two less one
  std::uint32_t free_ = none;     // lines to be used again
  std::size_t most_objects_ = 0;  // so many have room
  float scale_ = 1;
  int cell_bits_ = 5;
  std::size_t class_count_[classes + 1] = {};
  std::uint32_t used_ = 0;  // a bit each class that has boxes
};

template <class F>
std::uint64_t Cells::look(const cpu::PackedQuery& query, std::uint32_t home, F&& f) const {
  std::uint64_t compared = 0;
  for (std::uint32_t i = home; i != none;) {
    const Line& line = lines_[i];
    i = line.entry[0].link;
    compared += 2;
    const bool first = query.overlaps(line.entry[0]), second = query.overlaps(line.entry[1]);
    if (!(first | second)) continue;
    if (first) f(line.entry[0].id);
    if (second) f(line.entry[1].id);
  }
  return compared;
}

template <class F>
void Cells::each_home(const Box& box, Worlds worlds, F&& f) const {
  const Range range = quantise(box);
  for (std::uint32_t used = used_; used != 0; used &= used - 1) {
    const int c = std::countr_zero(used);
    const Range cells = cells_of(range, c);
    each_home(cells, c, worlds.own, f);
    if (worlds.everywhere) each_home(cells, c, -1, f);
  }
  if (class_count_[classes] != 0) f(wide_home());
}

template <class F>
void Cells::each_home(const Range& cells, int c, std::int32_t world, F&& f) const {
  for (std::int32_t z = cells.lower[2]; z <= cells.upper[2]; ++z) {
    for (std::int32_t y = cells.lower[1]; y <= cells.upper[1]; ++y) {
      const std::uint32_t h = row(c, world, y, z);
      for (std::int32_t x = cells.lower[0]; x <= cells.upper[0]; ++x) {
        f((h + static_cast<std::uint32_t>(x)) & mask_);
      }
    }
  }
}

// Chains and hits are put on lists, at no branch: nobody can guess where they are.
template <class F>
std::uint64_t Cells::search(const Box& box, Worlds worlds, Reach& reach, F&& f) const {
  const cpu::PackedQuery query(box);
  std::uint64_t compared = 0;
  if (reach.count <= Reach::most) {
    std::uint32_t hits[2 * Reach::room];
    std::uint32_t count = reach.count, hit_count = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const Line& line = lines_[reach.homes[k]];
      const std::uint32_t next = line.entry[0].link;
      if (count < Reach::room) {
        reach.homes[count] = next;
        count += next != none;
      } else if (next != none) {
        compared += look(query, next, f);  // a long chain, to its end
      }
      hits[hit_count] = line.entry[0].id;
      hit_count += query.overlaps(line.entry[0]);
      hits[hit_count] = line.entry[1].id;
      hit_count += query.overlaps(line.entry[1]);
    }
    for (std::uint32_t k = 0; k < hit_count; ++k) f(hits[k]);
    compared += 2 * std::uint64_t{count};
  } else if (expected_lines(box, worlds) < lines_.size()) {
    each_home(box, worlds, [&](std::uint32_t home) { compared += look(query, home, f); });
  } else {
    for (const Line& line : lines_) {
      if (query.overlaps(line.entry[0])) f(line.entry[0].id);
      if (query.overlaps(line.entry[1])) f(line.entry[1].id);
    }
    compared = 2 * lines_.size();
  }
  return compared;
}

}  // namespace throng::live
