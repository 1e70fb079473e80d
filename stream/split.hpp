// How boxes are cut into slabs along an axis, and why no pair is lost or told twice.
//
// Borders t[1] < t[2] < ... of the axis make slabs 0, 1, ... Let
//   home(b) = how many borders are <= b.lower: b begins in that slab,
//   last(b) = how many borders are <= reach(b), and home(b) at least: no box that overlaps b has a
//             home behind that slab.
// reach(b) is b.upper where there is no margin: if a overlaps b then a.lower <= b.upper, and a
// border that is <= a.lower is <= b.upper; so home(a) <= last(b), by comparisons of the given
// floats alone. A border may be any float: a face exactly on it is one of its comparisons.
//
// A box is kept once in the list home[home(b)] and, as a guest, in halo[s] of every s from
// home(b) + 1 to last(b). Slab s tells the pairs of home[s] with itself, and of home[s] with
// halo[s]. A pair a, b with home(a) = home(b) is told by that slab, in the first way, and by no
// other, since neither is at home elsewhere and two guests are never compared. With home(a) <
// home(b) = s it is told by slab s in the second way, as home(b) <= last(a) makes a its guest; and
// nowhere else, since b is no guest in home(a) < home(b). So each pair is told once, by the slab
// that holds the larger of the two lower bounds.
//
// A box with last(b) - home(b) > most_halos is wide: it is in no slab, but in one list of its own,
// however many slabs it spans. Wide boxes are compared with each slab's home[s], and with each
// other: again each pair once. In slab s a wide box w can be passed over unless home(w) <= s +
// most_halos and last(w) >= s: whoever overlaps w and is at home in s has s <= last(w), and home(w)
// is not behind its last slab, which is not behind s + most_halos.
//
// Of two sets each box has one home in its own set's lists, with the same borders: slab s tells
// home a[s] with home b[s], with halo b[s], and halo a[s] with home b[s].
#pragma once

#include <cstddef>
#include <vector>

#include "stream/rows.hpp"

namespace throng::stream {

struct Split {
  static constexpr int most_halos = 4;

  int axis = 0;
  float margin = 0;
  std::vector<float> borders;

  int slabs() const noexcept { return static_cast<int>(borders.size()) + 1; }
  // How far the lower bound of a box may lie that overlaps b.
  double reach(const Box& b) const noexcept;
  int home(const Box& b) const noexcept;
  // `home` is home(b).
  int last(const Box& b, int home) const noexcept;
};

// What the choice depends on.
struct SplitRequest {
  const Source* sides[2] = {};
  const Layout* layouts[2] = {};
  int side_count = 1;
  std::size_t slab_rows = 0;  // of both sets together, what a slab may have at home
  int most_slabs = 2;
  std::size_t sample_rows = 0;  // how many boxes to look at
  float margin = 0;
};

// The axis and the borders that move and compare the fewest rows, by a sample of the boxes: no pass
// over all of them is spent on the choice, as nothing but time hangs on it. No borders: cutting
// does not pay, as where all lie in one place.
Split choose_split(const SplitRequest& request);

}  // namespace throng::stream
