// Traverses cells along a sweep, layer by layer, in the order in which it may meet their boxes.
//
// The cells of each class are traversed along the axis on which the sweep crosses most of them. The
// boxes stored in a layer lie between two bounds on that axis: the first unit of the layer, and one
// span after its last unit. The sweep visits the cells that it may need between reaching the first
// bound and leaving the second.
//
// Why no box is lost: let the sweep meet a box, by touch(), from `enter` on. All values are
// doubles, in units. A quantized coordinate differs from the scaled one by less than one unit, and
// by 2^-24 of itself because the product is rounded. The bounds of a layer are widened by one unit
// and by 2^-22 of the largest magnitude. The bounds of the sweep are those of its Cover, which are
// widened by more than doubles round. So the interval in which box and sweep touch along this axis
// lies within that of the layer, and `enter` lies within the interval of the box. At `enter` the
// sweep overlaps the box; its bounds, also widened by 2^-22 of the largest magnitude, are quantized
// as those of a Cover. So the box is in one of the cells that a search of a Cover visits
// (cell_map.hpp), and in this layer. Where coordinates are clamped, from CellMap::most_units on,
// the sweep visits all layers for its whole time interval.
//
// The time interval is that in which the sweep meets the bounds of all boxes in cells. touch() is
// monotonic, so no such box is met earlier or first met later, and the LineSieve is limited to the
// end of that interval. Boxes too wide for cells are tested separately.
#pragma once

#include <cstdint>

#include "core/sweep.hpp"
#include "live/cells.hpp"
#include "live/sieve.hpp"

namespace throng::live {

class CellWalk {
 public:
  // Prefetches the first cells; only a few if the traversal may end early (`to_first`). `cover`: of
  // the sweep. With block data (Cells::blocks), layers of empty blocks are skipped.
  void start(const Cells& cells, const Blocks* blocks, Cells::Worlds worlds, const Sweep& sweep,
             const core::Cover& cover, bool to_first) noexcept;

  // Calls look(line, k) for each box k of a line that passes the LineSieve, possibly several times,
  // until no remaining box can be met before time `first`, which look() may decrease. Returns false
  // if it gave up because the traversal would visit more cells than a loop over all objects costs.
  template <class F>
  bool go(const double& first, Work& work, F&& look);
  // Number of cells visited at distances where block data would help.
  std::uint64_t looked_far() const noexcept { return far_; }

 private:
  // Position in the layers of one class.
  struct Way {
    double begin, length;        // time interval of the next layer
    double first, step;          // time of the first layer; difference between layers
    std::int32_t layer, passed;  // the next layer; number of layers passed
    std::int32_t layers;
    std::int32_t known;  // layers passed when blocks are checked next
    std::int16_t size_class;
    std::int8_t axis, on;  // direction, 1 or -1
    bool timeless;         // each layer has the whole time interval

    void pass(std::int32_t n = 1) noexcept {
      layer += n * on;
      passed += n;
      begin = first + step * passed;
    }
  };
  // A sweep that visits one cell per 16 lines costs as much as a loop over all objects.
  static constexpr std::size_t lines_a_cell = 16;
  // Cells are listed and prefetched before they are visited, several layers at once, until there
  // are enough. Their chains are appended while capacity allows.
  static constexpr std::uint32_t enough_to_first = 16, enough_of_all = 48, most = 192, room = 256;

  // Layers after which a cursor checks blocks, if there are any; and after which its cells count in
  // looked_far(), as most sweeps end before.
  static constexpr std::int32_t patience = 8, far = 16;

  void add_ways(const core::Cover& cover) noexcept;
  bool is_reached(Way& way) const noexcept;
  void skip_empty(Way& way) const noexcept;
  void find_cells(const Way& way, std::int32_t layers, double last,
                  CellMap::Range& cells) const noexcept;
  void choose() noexcept;
  bool is_over() const noexcept { return way_count_ == 0; }
  // Number of cells of the next layer, or too many. take_layer() calls f(bucket) for each and
  // advances.
  std::uint64_t next_cells() const noexcept {
    return cells_->home_count(range_, ways_[next_].size_class, worlds_, left_);
  }
  template <class F>
  void take_layer(F&& f);
  void list() noexcept;
  template <class F>
  void look_at_listed(const LineSieve& sieve, Work& work, F&& look);
  // Visits the lines of a bucket, first to last.
  template <class F>
  void look_at_chain(const LineSieve& sieve, std::uint32_t home, Work& work, F&& look) const;

  const Cells* cells_;
  const Blocks* blocks_;
  Cells::Worlds worlds_;
  double lower_[3], upper_[3], by_[3];  // the Cover, in units
  core::Touch inside_;                  // time interval
  const Sweep* sweep_;
  const core::Cover* cover_;
  CellMap::Range whole_, range_;  // units of the whole interval; cells of the next layer
  std::uint64_t left_, far_;      // cell budget; see looked_far()
  std::uint32_t count_, enough_;
  std::uint32_t homes_[room];
  unsigned way_count_, next_;
  Way ways_[CellMap::class_numbers];
};

template <class F>
void CellWalk::take_layer(F&& f) {
  Way& way = ways_[next_];
  const std::uint64_t count = next_cells();
  left_ -= count;
  if (way.passed >= far) far_ += count;
  cells_->each_home(range_, way.size_class, worlds_, f);
  way.pass();
  if (!is_reached(way)) way = ways_[--way_count_];
  choose();
}

template <class F>
bool CellWalk::go(const double& first, Work& work, F&& look) {
  if (worlds_.all) return false;
  if (cells_->has_wide())
    look_at_chain(LineSieve(SieveTerms(*sweep_, *cover_, 1)), cells_->wide_home(), work, look);
  if (count_ == 0 && is_over()) return true;
  const LineSieve sieve(SieveTerms(*sweep_, *cover_, inside_.leave));
  for (;;) {
    look_at_listed(sieve, work, look);
    if (is_over() || first < ways_[next_].begin) return true;
    list();
    if (count_ != 0) continue;
    if (next_cells() >= left_) return false;
    take_layer([&](std::uint32_t home) { look_at_chain(sieve, home, work, look); });
  }
}

// Appends hits and chains without branches, as in Cells::search_few().
template <class F>
void CellWalk::look_at_listed(const LineSieve& sieve, Work& work, F&& look) {
  struct Hit {
    const CellLine* line;
    std::uint32_t k;
  };
  Hit hits[2 * room + 1];
  std::uint32_t hit_count = 0, i = 0;
  work.visited += count_;
  for (; i < count_ && count_ < room; ++i) {
    const CellLine& line = cells_->line(homes_[i]);
    cells_->prefetch(line.next);
    homes_[count_] = line.next;
    count_ += line.next != 0;
    const std::uint32_t bits = sieve.passes(line);
    hits[hit_count] = {&line, 0};
    hit_count += bits & 1;
    hits[hit_count] = {&line, 1};
    hit_count += bits >> 1;
  }
  work.compared += 2 * std::uint64_t{i};
  for (std::uint32_t h = 0; h < hit_count; ++h) look(*hits[h].line, hits[h].k);
  for (; i < count_; ++i) look_at_chain(sieve, homes_[i], work, look);
  count_ = 0;
}

template <class F>
void CellWalk::look_at_chain(const LineSieve& sieve, std::uint32_t home, Work& work,
                             F&& look) const {
  std::uint32_t i = home;
  ++work.visited;
  do {
    const CellLine& line = cells_->line(i);
    const std::uint32_t bits = sieve.passes(line);
    work.compared += 2;
    if (bits & 1) look(line, 0);
    if (bits & 2) look(line, 1);
    i = line.next;
  } while (i != 0);
}

}  // namespace throng::live
