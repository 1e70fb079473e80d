// A sweep's way through cells, layer by layer, in the order in which it may meet what is in them.
//
// The cells of a class are gone through along the axis along which the sweep crosses most of them.
// The boxes whose home is in a layer lie between two bounds there: its first unit, and a span after
// its last one. The sweep looks into the cells that it may need from when it comes to the one until
// it leaves the other.
//
// Why no box is lost: let touch() say that the sweep meets a box from `enter` on. All is reckoned
// in units, in doubles. A coordinate is less than one unit off the number that it is cut to, and
// 2^-24 of itself, as its product is rounded; the bounds of a layer are put further out by a unit
// and by 2^-22 of the furthest number there is. Those of the sweep are those of its Cover, so they
// are further out by more than doubles round. So the times at which the box and the sweep begin and
// end to touch along this axis lie between those of the layer, and `enter` lies between the former.
// Where the sweep is then overlaps the box, and its bounds, put further out by 2^-22 of the
// furthest number, too, are cut as a Cover's would be; so the box is in one of the cells in which a
// search of a Cover looks (cell_map.hpp), and it is in this layer. Where numbers of units are cut
// off, as they are from CellMap::most_units on, the sweep looks into all layers for all of its
// time.
//
// Its time is that in which it meets what holds all boxes in cells: of none of them does touch()
// say that it is met before, or begins to be met after, as none of its steps decreases. So its
// sieve, too, is that of the sweep until then. Boxes that are too wide for cells are looked at by
// themselves.
#pragma once

#include <cstdint>

#include "core/sweep.hpp"
#include "live/cells.hpp"
#include "live/sieve.hpp"

namespace throng::live {

class CellWalk {
 public:
  // Asks for the cells that it looks into first: for not too many, if it may end early. `cover`:
  // the sweep's.
  // Where empty blocks are known (Cells::blocks), layers of those are passed over.
  void start(const Cells& cells, const Blocks* blocks, Cells::Worlds worlds, const Sweep& sweep,
             const core::Cover& cover, bool to_first) noexcept;

  // look(line, k) for box k of a line, all that pass a sieve, some several times; until nothing
  // that is left is met before time `first`, which look() may make less. False: it gave up, as more
  // cells are to be looked at than going through all objects takes.
  template <class F>
  bool go(const double& first, Work& work, F&& look);
  // How many cells it has looked into further on than where blocks of them are of use.
  std::uint64_t looked_far() const noexcept { return far_; }

 private:
  // Through the cells of a class.
  struct Way {
    double begin, length;        // of the next layer, in time
    double first, step;          // when the first one begins, and how much later each other one
    std::int32_t layer, passed;  // the next one's number; how many have been passed
    std::int32_t layers;
    std::int32_t
        known;  // once so many have been passed, it is asked whether those behind are empty
    std::int16_t size_class;
    std::int8_t axis, on;  // to the next number
    bool timeless;         // each layer has all of the sweep's time

    void pass(std::int32_t n = 1) noexcept {
      layer += n * on;
      passed += n;
      begin = first + step * passed;
    }
  };
  // A sweep that looks into one cell for each sixteen lines has cost as much as going through all
  // objects does.
  static constexpr std::size_t lines_a_cell = 16;
  // Cells are listed, and so asked for, before they are looked at: some layers, until there are
  // enough. What lies behind those cells goes on the list, too, as far as there is room.
  static constexpr std::uint32_t enough_to_first = 16, enough_of_all = 48, most = 192, room = 256;

  // Blocks of cells, if there are any, are looked at from so many layers on; and from so many they
  // would be of use to a sweep that has none, as most end before.
  static constexpr std::int32_t patience = 8, far = 16;

  void add_ways(const core::Cover& cover) noexcept;
  bool is_reached(Way& way) const noexcept;
  void skip_empty(Way& way) const noexcept;
  void find_cells(const Way& way, std::int32_t layers, double last,
                  CellMap::Range& cells) const noexcept;
  void choose() noexcept;
  bool is_over() const noexcept { return way_count_ == 0; }
  // How many cells the next layer has, or too many; f(home) for each of them, and on to the next.
  std::uint64_t next_cells() const noexcept {
    return cells_->home_count(range_, ways_[next_].size_class, worlds_, left_);
  }
  template <class F>
  void take_layer(F&& f);
  void list() noexcept;
  template <class F>
  void look_at_listed(const LineSieve& sieve, Work& work, F&& look);
  // At a home's lines, first to last.
  template <class F>
  void look_at_chain(const LineSieve& sieve, std::uint32_t home, Work& work, F&& look) const;

  const Cells* cells_;
  const Blocks* blocks_;
  Cells::Worlds worlds_;
  double lower_[3], upper_[3], by_[3];  // the Cover, in units
  core::Touch inside_;                  // its time
  const Sweep* sweep_;
  const core::Cover* cover_;
  CellMap::Range whole_, range_;  // of all that time, in units; the next layer's cells
  std::uint64_t left_, far_;      // so many cells, and it gives up; see looked_far()
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

// Hits are noted, and chains put on the list, without a branch, as in Cells::search_few().
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
