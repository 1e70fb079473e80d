// How boxes are cut into slabs along an axis, and why each pair is reported exactly once.
//
// Borders t[1] < t[2] < ... of the axis make slabs 0, 1, ... Let
//   owner(b) = the number of borders <= b.lower: b begins in this slab,
//   last(b) = the number of borders <= reach(b), at least owner(b): every box that overlaps b has
//             an owner slab <= last(b).
// reach(b) is b.upper where there is no margin: if a overlaps b then a.lower <= b.upper, and every
// border <= a.lower is <= b.upper; so owner(a) <= last(b), by comparisons of the given floats
// alone. A border may be any float, also one that equals a face.
//
// A box is stored once in the list owned[owner(b)], and once in halo[s] of every s from owner(b) +
// 1 to last(b). Slab s reports the pairs of owned[s] with itself, and of owned[s] with halo[s]. Let
// a, b be a pair. If owner(a) = owner(b) = s, slab s reports it in the first way. No other slab
// does: neither box is owned elsewhere, and two halo rows are never compared. If owner(a) <
//   owner(b) = s, slab s reports it in the second way, as owner(b) <= last(a) puts a into halo[s];
//   no
// other slab does, since b is not in a halo of slab owner(a) < owner(b). So each pair is reported
// once, by the slab that holds the larger of the two lower bounds.
//
// A box with last(b) - owner(b) > max_halos is wide: it is stored in one list of wide boxes
// instead, however many slabs it spans. Wide boxes are compared with each slab's owned[s], and with
// each other: again each pair once. Slab s can skip a wide box w unless owner(w) <= s + max_halos
// and last(w) >= s: a box b that is owned by s and overlaps w has s <= last(w) and owner(w) <=
// last(b) <= s + max_halos.
//
// With two sets each box has one owner slab, in its own set's lists, with the same borders: slab s
// compares owned a[s] with owned b[s] and with halo b[s], and halo a[s] with owned b[s].
#pragma once

#include <cstddef>
#include <vector>

#include "apps/stream/rows.hpp"

namespace throng::stream {

struct Split {
  static constexpr int max_halos = 4;

  int axis = 0;
  float margin = 0;
  std::vector<float> borders;

  int slabs() const noexcept { return static_cast<int>(borders.size()) + 1; }
  // Upper bound of the lower bound of boxes that overlap b.
  double reach(const Box& b) const noexcept;
  int owner(const Box& b) const noexcept;
  // `owner` is owner(b).
  int last(const Box& b, int owner) const noexcept;
};

// The inputs of the choice.
struct SplitRequest {
  const Source* sides[2] = {};
  const Layout* layouts[2] = {};
  int side_count = 1;
  std::size_t slab_rows = 0;  // of both sets together, the limit of a slab's owned rows
  int max_slabs = 2;
  std::size_t sample_rows = 0;  // sample size
  float margin = 0;
};

// The axis and borders that move and compare the fewest rows, estimated from a sample of the boxes.
// No full pass: a poor choice costs time only. No borders: cutting does not pay, as for boxes in
// one place.
Split choose_split(const SplitRequest& request);

}  // namespace throng::stream
