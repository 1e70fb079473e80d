// Cells by size classes: where objects lie that mostly stay. Each box is kept once, in the
// cell of its lower corner, and looked for with a handful of cache lines.
//
// One function per axis maps a float to a whole number of units, q(x) = int(clamp(x * scale)).
// Each step is non-decreasing in round-to-nearest, so q is, for every float but NaN, infinities
// included. A box is of the first class c whose span 16 << c is at least q(upper) - q(lower) on
// every axis; cells of that class are 32 << c units long, 16 << c
// where boxes are dense, and the box's home on an axis is q(lower) >> (bits + c), bits 5 or 4.
//
// Where boxes are mostly long and thin, rods and plates, a class also tells along which axes an
// eighth of its span is enough: there c is less by 3. A search then takes for the span along an
// axis the longest that any box of the class has had there.
//
// Why no pair is lost: let box b of class c overlap box a. On every axis b.lower <= a.upper and
// a.lower <= b.upper, so q(b.lower) <= q(a.upper), and q(b.lower) >= q(b.upper) - span >=
// q(a.lower) - span. Shifting keeps the order: b's home is one of the cells
//   (q(a.lower) - span) >> (bits + c)  ..  q(a.upper) >> (bits + c),
// c being that of the axis, and a search of a looks into all of those, for every class in use. No
// float is widened.
//
// Cells that fall on one another only cost comparisons of boxes. A search may see a box twice then;
// whoever searches sorts that out.
#pragma once

#include <algorithm>
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
  // empty place is all NaN, which overlaps nothing. `next`: the next line of the chain, or 0, which
  // is in none; `used`: how many boxes are in this one.
  using Line = cpu::PackedLine;

  explicit Cells(cpu::Memory& memory) noexcept : lines_(memory), sample_(memory) {}

  // Where nearly all boxes begin along an axis, and how far they lie apart.
  struct Extent {
    double begin, length;
  };
  // A box that is looked at for a plan: its longest side, of a thin one an eighth of that; where it
  // begins, and in which cell.
  struct Sampled {
    double side;
    float lower[3];
    std::uint64_t cell;
  };

  // Empties the cells and measures the active objects for new ones.
  void plan(const Objects& objects);
  // Whether so many fit without a new plan.
  bool takes(std::size_t objects) const noexcept { return objects <= most_objects_; }

  // What a search looks into: which worlds, beside that of the box itself.
  struct Worlds {
    std::int32_t own = -1;
    bool everywhere = false;  // those of world -1, too: there are such, and `own` is another
    bool all = false;         // every world: `own` is -1, and there are others
  };
  // Where a box belongs, and how many lines a search of it looks at, but for chains: at most so
  // many, and no more than there are.
  struct Place {
    std::uint32_t home;
    int size_class;
    std::uint64_t lines;
  };
  Place place(const Box& box, Worlds worlds) const noexcept;
  void insert(ObjectId id, const Box& box, const Place& place) noexcept;
  void erase(ObjectId id, std::uint32_t home) noexcept;
  // Of one that stays in its home.
  void replace(ObjectId id, const Box& box, const Place& place) noexcept;

  // A search in three steps, so that memory can be asked for ahead: where to look, which brings the
  // cells nearer; what lies behind them nearer; and the search, which calls f(id) for every box
  // that overlaps this one, some of them several times, and returns how many were compared. What f
  // throws comes through: it may want memory.
  struct Reach {
    static constexpr std::uint32_t most = 224, room = 256;
    std::uint32_t count;  // above `most`: too many to list
    std::uint32_t homes[room];
  };
  void reach(const Box& box, Worlds worlds, Reach& reach) const noexcept;
  void prefetch_chains(const Reach& reach) const noexcept {
    if (reach.count > Reach::most) return;
    for (std::uint32_t k = 0; k < reach.count; ++k) prefetch_chain(reach.homes[k]);
  }
  template <class F>
  std::uint64_t search(const Box& box, Worlds worlds, Reach& reach, F&& f) const;
  // Its two ways. Where few lines are to be looked at: writes all that overlap but `self` to hits,
  // which has most_hits of room and one more, and returns how many. Above most_hits: that was not
  // enough.
  static constexpr std::uint32_t most_hits = 2 * Reach::room;
  std::uint32_t search_few(const Box& box, ObjectId self, Reach& reach, ObjectId* hits,
                           std::uint64_t& compared) const noexcept;
  // And where many are.
  template <class F>
  std::uint64_t search_many(const Box& box, Worlds worlds, F&& f) const;
  // The line behind the first. Where there is none, line 0: a branch would be guessed wrong.
  void prefetch_chain(std::uint32_t home) const noexcept { prefetch(lines_[home].next); }
  void prefetch(std::uint32_t home) const noexcept { cpu::prefetch(&lines_[home]); }

  std::size_t line_count() const noexcept { return lines_.size(); }
  // A length in the units that cells are made of.
  double units(double length) const noexcept { return length * static_cast<double>(scale_); }

  void reserve_for(const Cells& other) {
    lines_.reserve(lines_for(other.homes_, other.most_objects_));
  }
  void copy(const Cells& other) noexcept;

 private:
  // Lines behind others are full, so there are at most half as many as boxes.
  static std::size_t lines_for(std::size_t homes, std::size_t objects) noexcept {
    return homes + 1 + objects / 2 + 1;
  }
  std::size_t lay_out(const Extent (&extent)[3], std::size_t count) noexcept;
  static constexpr int classes = 24;
  // The number of a class is its c and, above, a bit for each thin axis, which are two at most.
  static constexpr int thin_shift = 5, thinner = 3, thin_sets = 7;
  static constexpr int span_bits = 4;
  static constexpr float most_units = 0x1p28f;

  struct alignas(16) Range {
    std::int32_t lower[4], upper[4];  // the last of each is of no meaning
  };
  Range quantise(const Box& b) const noexcept {
    Range r;
    cpu::whole_units(b, scale_, most_units, r.lower, r.upper);
    return r;
  }
  // `classes` for a box too wide for any: those share one chain.
  int class_of(const Range& r) const noexcept {
    std::int32_t span = 1;
    for (int k = 0; k < 3; ++k) span = std::max(span, r.upper[k] - r.lower[k]);
    const int bits = std::bit_width(static_cast<std::uint32_t>(span - 1));
    const int c = std::clamp(bits - span_bits, 0, classes);
    if (!thin_ || c < thinner || c == classes) return c;
    const std::int32_t thin_span = 1 << (span_bits + c - thinner);
    int axes = 0;
    for (int k = 0; k < 3; ++k) axes |= (r.upper[k] - r.lower[k] <= thin_span) << k;
    return c | axes << thin_shift;
  }
  void hold(const Box& box, int size_class) noexcept {
    if (!thin_ || size_class == classes) return;
    const Range r = quantise(box);
    for (int k = 0; k < 3; ++k)
      span_[size_class][k] = std::max(span_[size_class][k], r.upper[k] - r.lower[k]);
  }
  // Its c along an axis.
  int level(int size_class, int axis) const noexcept {
    if (!thin_) return size_class;
    const int c = size_class & ((1 << thin_shift) - 1);
    return c - thinner * (size_class >> thin_shift >> axis & 1);
  }
  // A cell's home is the sum of four numbers, modulo the count of homes: one of its class and
  // world, and one an axis. Where the world is mostly full, those count cells, row by row and layer
  // by layer, and begin again after so many: neighbours lie side by side, and no two fall on one
  // another but far ones. Else those of y and z are hashed.
  struct Axis {
    std::int32_t origin;  // in units: about where boxes begin
    // period 0: hashed. lift: a multiple of it, of at least 2^26.
    std::uint32_t period, stride, lift;
  };
  struct Cursor {
    std::int32_t cell;
    std::uint32_t rest, part;  // cell modulo the period; its part of the sum
  };
  static std::uint32_t mixed(std::uint32_t h) noexcept {
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
  }
  // 0 .. homes - 1.
  std::uint32_t hashed(std::uint32_t x) const noexcept {
    const std::uint64_t product = std::uint64_t{mixed(x)} * homes_;
    return static_cast<std::uint32_t>(product >> 32);
  }
  std::uint32_t first_part(int c, std::int32_t world) const noexcept {
    if (c == 0 && world == -1) return 0;
    return hashed((static_cast<std::uint32_t>(world) * 256 + static_cast<std::uint32_t>(c)) *
                  0x9e3779b1u);
  }
  std::uint32_t hashed_part(std::int32_t cell, const Axis& axis) const noexcept {
    return hashed((static_cast<std::uint32_t>(cell) ^ axis.lift) * 0x9e3779b1u);
  }
  // How many cells of class c it lies behind the origin: most by less than the period. What lies
  // before it, by less than 2^26, counts as far behind.
  std::uint32_t behind_origin(std::int32_t cell, int c, int axis) const noexcept {
    return static_cast<std::uint32_t>(cell - (axis_[axis].origin >> (cell_bits_ + level(c, axis))));
  }
  Cursor cursor(std::int32_t cell, int c, int k) const noexcept {
    const Axis& axis = axis_[k];
    if (axis.period == 0) return {cell, 0, hashed_part(cell, axis)};
    std::uint32_t rest = behind_origin(cell, c, k);
    if (rest >= axis.period) [[unlikely]]
      rest = (rest + axis.lift) % axis.period;
    return {cell, rest, rest * axis.stride};
  }
  void step(Cursor& at, const Axis& axis) const noexcept {
    ++at.cell;
    if (axis.period == 0) {
      at.part = hashed_part(at.cell, axis);
    } else {
      ++at.rest;
      at.part += axis.stride;
      if (at.rest == axis.period) at.rest = at.part = 0;
    }
  }
  std::uint32_t sum(std::uint32_t a, std::uint32_t b) const noexcept {
    return std::min(a + b, a + b - homes_);  // both below homes_, which is at most 2^31
  }
  std::uint32_t wide_home() const noexcept { return homes_; }
  Range cells_of(const Range& r, int size_class) const noexcept {
    Range cells;
    if (thin_) {
      for (int k = 0; k < 3; ++k) {
        const int bits = cell_bits_ + level(size_class, k);
        cells.lower[k] = (r.lower[k] - span_[size_class][k]) >> bits;
        cells.upper[k] = r.upper[k] >> bits;
      }
      return cells;
    }
    for (int k = 0; k < 4; ++k) {
      cells.lower[k] = (r.lower[k] - (1 << (span_bits + size_class))) >> (cell_bits_ + size_class);
      cells.upper[k] = r.upper[k] >> (cell_bits_ + size_class);
    }
    return cells;
  }
  // Of classes no smaller than its own, a box looks into 2 or 3 cells an axis: less than 32 << c
  // units, in cells of that length or of half of it.
  std::uint64_t lines_of(const Range& r, int size_class, Worlds worlds) const noexcept {
    if (thin_) return exact_lines(r, worlds);
    const bool smallest = (used_[0] & ((1u << size_class) - 1)) == 0;
    if (!one_class() || !smallest || worlds.all || worlds.everywhere) return exact_lines(r, worlds);
    return std::min<std::uint64_t>(cell_bits_ == span_bits ? 27 : 8, lines_.size());
  }
  std::uint64_t exact_lines(const Range& r, Worlds worlds) const noexcept;
  // At most 2^26 an axis. More than there are lines: the product need not be known.
  std::uint64_t lines_in(const Range& cells) const noexcept {
    std::uint64_t n[3];
    for (int k = 0; k < 3; ++k)
      n[k] = static_cast<std::uint64_t>(std::int64_t{cells.upper[k]} - cells.lower[k] + 1);
    const std::uint64_t layer = n[0] * n[1];
    return layer >= lines_.size() ? lines_.size() : layer * n[2];
  }
  void count_class(int size_class, int one) noexcept {
    const int axes = size_class >> thin_shift, c = level(size_class, 3);
    class_count_[axes][c] += static_cast<std::size_t>(one);
    const std::uint32_t bit = 1u << c;
    std::uint32_t& used = used_[axes];
    used = class_count_[axes][c] != 0 ? used | bit : used & ~bit;
    used &= (1u << classes) - 1;
  }
  // Not asked where boxes are thin.
  bool one_class() const noexcept {
    return (used_[0] & (used_[0] - 1)) == 0 && class_count_[0][classes] == 0;
  }
  int class_in(const Line& line, std::uint32_t k) const noexcept {
    return !thin_ && one_class() ? std::countr_zero(used_[0]) : class_of(quantise(line.box(k)));
  }
  // f(class) for each that has boxes in cells.
  template <class F>
  void each_class(F&& f) const {
    for (int axes = 0; axes < (thin_ ? thin_sets : 1); ++axes) {
      for (std::uint32_t used = used_[axes]; used != 0; used &= used - 1)
        f(std::countr_zero(used) | axes << thin_shift);
    }
  }
  template <class F>
  void each_home(const Range& cells, int c, std::int32_t world, F&& f) const;
  template <class F>
  std::uint64_t look(const cpu::PackedQuery& query, std::uint32_t home, F&& f) const;

  List<Line> lines_;
  List<Sampled> sample_;     // of the last plan
  std::uint32_t homes_ = 1;  // of cells; the one after is that of too wide boxes
  Axis axis_[3] = {};
  std::uint32_t free_ = 0;        // lines to be used again
  std::size_t most_objects_ = 0;  // so many have room
  float scale_ = 1;
  int cell_bits_ = 5;
  bool thin_ = false;                                   // whether there are classes of thin boxes
  std::int32_t span_[thin_sets << thin_shift][3] = {};  // then: that boxes of a class have had
  // By thin axes; [0][classes] of boxes too wide for any. A bit each class that has boxes.
  std::size_t class_count_[thin_sets][classes + 1] = {};
  std::uint32_t used_[thin_sets] = {};
};

// Of an object with this filter, or a box that is asked about as if it had.
inline Cells::Worlds worlds_of(const Objects& objects, const Filter& filter) noexcept {
  if (objects.in_worlds() == 0) return {};
  if (filter.world == -1) return {-1, false, true};
  return {filter.world, objects.in_worlds() != objects.count(), false};
}

template <class F>
std::uint64_t Cells::look(const cpu::PackedQuery& query, std::uint32_t home, F&& f) const {
  std::uint64_t compared = 0;
  std::uint32_t i = home;
  do {
    const Line& line = lines_[i];
    i = line.next;
    compared += 2;
    const std::uint32_t hit = query.overlaps(line);
    if (hit & 1) f(line.id[0]);
    if (hit & 2) f(line.id[1]);
  } while (i != 0);
  return compared;
}

template <class F>
void Cells::each_home(const Range& cells, int c, std::int32_t world, F&& f) const {
  const std::uint32_t first = first_part(c, world);
  // Where no axis begins again, and the sum does not, homes are counted as cells are.
  std::uint32_t begin = first, n[3];
  std::uint64_t end = first + std::uint64_t{1};
  bool once = true;
  for (int k = 0; k < 3; ++k) {
    const Axis& axis = axis_[k];
    const std::uint32_t rest = behind_origin(cells.lower[k], c, k);
    n[k] = static_cast<std::uint32_t>(cells.upper[k] - cells.lower[k] + 1);
    once &= rest < axis.period && n[k] <= axis.period - rest;
    begin += rest * axis.stride;
    end += (rest + std::uint64_t{n[k]} - 1) * axis.stride;
  }
  if (once && end <= homes_) [[likely]] {
    for (std::uint32_t z = 0; z < n[2]; ++z) {
      for (std::uint32_t y = 0; y < n[1]; ++y) {
        const std::uint32_t row = begin + z * axis_[2].stride + y * axis_[1].stride;
        for (std::uint32_t x = 0; x < n[0]; ++x) f(row + x);
      }
    }
    return;
  }
  const Cursor x0 = cursor(cells.lower[0], c, 0), y0 = cursor(cells.lower[1], c, 1);
  Cursor z = cursor(cells.lower[2], c, 2);
  for (; z.cell <= cells.upper[2]; step(z, axis_[2])) {
    const std::uint32_t layer = sum(first, z.part);
    for (Cursor y = y0; y.cell <= cells.upper[1]; step(y, axis_[1])) {
      const std::uint32_t row = sum(layer, y.part);
      for (Cursor x = x0; x.cell <= cells.upper[0]; step(x, axis_[0])) f(sum(row, x.part));
    }
  }
}

template <class F>
std::uint64_t Cells::search(const Box& box, Worlds worlds, Reach& reach, F&& f) const {
  std::uint64_t compared = 0;
  ObjectId hits[most_hits + 1];
  const std::uint32_t count = search_few(box, none, reach, hits, compared);
  if (count <= most_hits) {
    for (std::uint32_t k = 0; k < count; ++k) f(hits[k]);
    return compared;
  }
  return search_many(box, worlds, f);
}

template <class F>
std::uint64_t Cells::search_many(const Box& box, Worlds worlds, F&& f) const {
  std::uint64_t compared = 0;
  const cpu::PackedQuery query(box);
  const Range range = quantise(box);
  if (!worlds.all && exact_lines(range, worlds) < lines_.size()) {
    // Asked for some at once, then looked at.
    constexpr std::uint32_t at_once = 64;
    std::uint32_t homes[at_once], count = 0;
    const auto look_at_all = [&] {
      for (std::uint32_t k = 0; k < count; ++k) compared += look(query, homes[k], f);
      count = 0;
    };
    const auto look_soon = [&](std::uint32_t home) {
      prefetch(home);
      homes[count++] = home;
      if (count == at_once) look_at_all();
    };
    each_class([&](int c) {
      const Range cells = cells_of(range, c);
      each_home(cells, c, worlds.own, look_soon);
      if (worlds.everywhere) each_home(cells, c, -1, look_soon);
    });
    look_at_all();
    if (class_count_[0][classes] != 0) compared += look(query, wide_home(), f);
  } else {
    for (const Line& line : lines_) {
      const std::uint32_t hit = query.overlaps(line);
      if (hit & 1) f(line.id[0]);
      if (hit & 2) f(line.id[1]);
    }
    compared += 2 * lines_.size();
  }
  return compared;
}

}  // namespace throng::live
