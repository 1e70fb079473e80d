// Splits a rank's region further at gaps, so that groups of boxes that lie far apart get one grid
// each.
//
// A single grid wastes columns on the empty space between groups: for the scene `clusters` on 32
// ranks it makes 81 comparisons per box, one grid per cluster 36. The excess depends on the other
// content of a region, so no partition balances it. Distributing the boxes costs more time than it
// saves, though: see Settings::parts. A part is a region like that of a rank; regions.hpp proves
// that each pair is reported by exactly one of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "mpi/regions.hpp"

namespace throng::mpi {

class GapPartition {
 public:
  // Indices of the boxes to sample, out of `boxes`: one hashed position per run, since the caller's
  // order may have that period. Empty for few boxes.
  static std::vector<std::size_t> sample(std::size_t boxes);
  // Splits the region at gaps of the sample; empty sample: one part.
  GapPartition(const Bounds& region, std::vector<KeyBox> sample);

  std::size_t count() const noexcept { return bounds_.size(); }
  const Bounds& bounds(std::size_t part) const noexcept { return bounds_[part]; }

  // Calls f(part) for each part that `key_box` overlaps; `key_box` must not be empty.
  template <class F>
  void visit(const KeyBox& key_box, F&& f) const {
    visit(0, key_box, f);
  }
  // Writes the part of each of at most `batch` boxes, or `several`. Most boxes overlap one part;
  // all descend the tree in lockstep, without data-dependent branches.
  static constexpr std::size_t batch = 32;
  static constexpr std::uint32_t several = 0xffffffff;
  void locate(const KeyBox* key_boxes, std::size_t count, std::uint32_t* parts) const noexcept;

 private:
  // A leaf is its own child, and its cut is the lowest key, so that all boxes stay there.
  struct Node {
    Key at = std::numeric_limits<Key>::min();
    std::int32_t axis = 0;
    std::uint32_t child[2];
    std::uint32_t part = 0;
  };

  template <class F>
  void visit(std::uint32_t at, const KeyBox& key_box, F& f) const {
    const Node& node = nodes_[at];
    if (node.child[0] == at) return f(std::size_t{node.part});
    if (key_box.lower[node.axis] < node.at) visit(node.child[0], key_box, f);
    if (key_box.upper[node.axis] >= node.at) visit(node.child[1], key_box, f);
  }
  std::uint32_t cut(const Bounds& region, KeyBox* sample, std::size_t count, int depth);

  std::vector<Node> nodes_;  // the root first
  std::vector<Bounds> bounds_;
  int depth_ = 0;
};

}  // namespace throng::mpi
