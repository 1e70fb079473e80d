// Traverses cells along a sweep, layer by layer, in the order in which it may meet their boxes.
//
// The cells of each class are traversed along the axis on which the sweep crosses most of them. The
// boxes stored in a layer lie between two bounds on that axis: the first unit of the layer, and one
// span after its last unit. The sweep visits the cells that it may need between reaching the first
// bound and leaving the second.
//
// Why no box is lost: let the sweep meet a box, by contact_interval(), from `enter` on. All values
// are doubles, in units. A quantized coordinate differs from the scaled one by less than one unit,
// and by 2^-24 of itself because the product is rounded. The bounds of a layer are widened by one
// unit and by 2^-22 of the largest magnitude. The bounds of the sweep are its swept bounds,
// which are widened by more than doubles round. So the interval in which box and sweep touch along
// this axis lies within that of the layer, and `enter` lies within the interval of the box. At
// `enter` the sweep overlaps the box; its bounds, also widened by 2^-22 of the largest magnitude,
// are quantized as swept bounds are. So the box is in one of the cells that a search of the
// swept bounds visits (cell_map.hpp), and in this layer. Where coordinates are clamped, from
// CellMap::max_units on, the sweep visits all layers for its whole time interval.
//
// The time interval is that in which the sweep meets the bounds of all boxes in cells.
// contact_interval() is monotonic, so no such box is met earlier or first met later, and the
// SweepPrefilter is limited to the end of that interval. Boxes too wide for cells are
// tested separately.
#pragma once

#include <cstdint>

#include "base/swept_box.hpp"
#include "tracking/cells.hpp"
#include "tracking/sweep_prefilter.hpp"

namespace throng::tracking {

class GridTraversal {
 public:
  // `to_first`: the traversal may end early. `cover`: of the sweep. With block data
  // (Cells::blocks), layers of empty blocks are skipped.
  GridTraversal(const Cells& cells, const BlockOccupancy* blocks, Cells::Worlds worlds,
                const base::MovingBox& sweep, const base::SweptBounds& cover,
                bool to_first) noexcept;

  // Calls visit(line, k) for each box k of a line that passes the SweepPrefilter, possibly
  // several times, until no remaining box can be met before time `first`, which visit() may
  // decrease. Returns false if it gave up because the traversal would visit more cells than a loop
  // over all objects costs.
  template <class F>
  bool traverse(const double& first, Work& work, F&& visit);

 private:
  // Position in the layers of one class.
  struct LayerCursor {
    double begin, length;        // time interval of the next layer
    double first, step;          // time of the first layer; difference between layers
    std::int32_t layer, passed;  // the next layer; number of layers passed
    std::int32_t layers;
    std::int32_t next_block_check;  // layers passed when blocks are checked next
    std::int16_t size_class;
    std::int8_t axis, direction;  // direction, 1 or -1
    bool covers_all_time;         // each layer has the whole time interval

    void pass(std::int32_t n = 1) noexcept {
      layer += n * direction;
      passed += n;
      begin = first + step * passed;
    }
  };
  // A sweep that visits one cell per 16 lines costs as much as a loop over all objects.
  static constexpr std::size_t lines_per_cell = 16;
  // Cells are listed and prefetched before they are visited, several layers at once, until there
  // are enough. Their chains are appended while capacity allows.
  static constexpr std::uint32_t list_target_first = 16, list_target_all = 48, most = 192,
                                 capacity = 256;

  // Layers after which a cursor checks blocks, if there are any; and after which its cells count in
  // Work::far, as most sweeps end before.
  static constexpr std::int32_t block_check_layers = 8, block_benefit_layers = 16;

  template <class F>
  bool visit_layers(const double& first, Work& work, F&& visit);
  void init_cursors() noexcept;
  bool advance_to_reached(LayerCursor& cursor) const noexcept;
  void skip_empty(LayerCursor& cursor) const noexcept;
  void find_cells(const LayerCursor& cursor, std::int32_t layers, double last,
                  CellMap::Range& cells) const noexcept;
  void select_next() noexcept;
  bool is_over() const noexcept { return cursor_count_ == 0; }
  // Number of cells of the next layer, or too many. take_layer() calls f(bucket) for each and
  // advances.
  std::uint64_t next_cells() const noexcept {
    return cells_.bucket_count(range_, cursors_[next_].size_class, worlds_, left_);
  }
  template <class F>
  void take_layer(F&& f);
  void list_cells() noexcept;
  template <class F>
  void visit_listed(const SweepPrefilter& prefilter, Work& work, F&& visit);
  // Visits the lines of a bucket, first to last.
  template <class F>
  void visit_chain(const SweepPrefilter& prefilter, std::uint32_t bucket, Work& work,
                   F&& visit) const;

  const Cells& cells_;
  const BlockOccupancy* const blocks_;
  const Cells::Worlds worlds_;
  const base::MovingBox& sweep_;
  const base::SweptBounds& cover_;
  const std::uint32_t list_target_;
  double lower_[3], upper_[3], by_[3];  // the swept bounds, in units
  base::ContactInterval interval_;      // time interval
  CellMap::Range whole_range_, range_;  // units of the whole interval; cells of the next layer
  std::uint64_t left_, far_cells_ = 0;  // cell budget; see Work::far
  std::uint32_t count_ = 0;
  std::uint32_t buckets_[capacity];
  unsigned cursor_count_ = 0, next_ = 0;
  LayerCursor cursors_[CellMap::class_numbers];
};

template <class F>
void GridTraversal::take_layer(F&& f) {
  LayerCursor& cursor = cursors_[next_];
  const std::uint64_t count = next_cells();
  left_ -= count;
  if (cursor.passed >= block_benefit_layers) far_cells_ += count;
  cells_.each_bucket(range_, cursor.size_class, worlds_, f);
  cursor.pass();
  if (!advance_to_reached(cursor)) cursor = cursors_[--cursor_count_];
  select_next();
}

template <class F>
bool GridTraversal::traverse(const double& first, Work& work, F&& visit) {
  if (worlds_.all) return false;
  const bool completed = visit_layers(first, work, visit);
  work.far += far_cells_;
  return completed;
}

template <class F>
bool GridTraversal::visit_layers(const double& first, Work& work, F&& visit) {
  if (cells_.has_wide())
    visit_chain(SweepPrefilter(sweep_.box, cover_, 1), cells_.wide_bucket(), work, visit);
  if (count_ == 0 && is_over()) return true;
  const SweepPrefilter prefilter(sweep_.box, cover_, interval_.leave);
  for (;;) {
    visit_listed(prefilter, work, visit);
    if (is_over() || first < cursors_[next_].begin) return true;
    list_cells();
    if (count_ != 0) continue;
    if (next_cells() >= left_) return false;
    take_layer([&](std::uint32_t bucket) { visit_chain(prefilter, bucket, work, visit); });
  }
}

// Appends hits and chains without branches, as in Cells::search_few().
template <class F>
void GridTraversal::visit_listed(const SweepPrefilter& prefilter, Work& work, F&& visit) {
  struct Hit {
    const CellLine* line;
    std::uint32_t k;
  };
  Hit hits[2 * capacity + 1];
  std::uint32_t hit_count = 0, i = 0;
  work.visited += count_;
  for (; i < count_ && count_ < capacity; ++i) {
    const CellLine& line = cells_.line(buckets_[i]);
    cells_.prefetch(line.next);
    buckets_[count_] = line.next;
    count_ += line.next != 0;
    const std::uint32_t bits = prefilter.passes(line);
    hits[hit_count] = {&line, 0};
    hit_count += bits & 1;
    hits[hit_count] = {&line, 1};
    hit_count += bits >> 1;
  }
  work.compared += 2 * std::uint64_t{i};
  for (std::uint32_t h = 0; h < hit_count; ++h) visit(*hits[h].line, hits[h].k);
  for (; i < count_; ++i) visit_chain(prefilter, buckets_[i], work, visit);
  count_ = 0;
}

template <class F>
void GridTraversal::visit_chain(const SweepPrefilter& prefilter, std::uint32_t bucket, Work& work,
                                F&& visit) const {
  std::uint32_t i = bucket;
  ++work.visited;
  do {
    const CellLine& line = cells_.line(i);
    const std::uint32_t bits = prefilter.passes(line);
    work.compared += 2;
    if (bits & 1) visit(line, 0);
    if (bits & 2) visit(line, 1);
    i = line.next;
  } while (i != 0);
}

}  // namespace throng::tracking
