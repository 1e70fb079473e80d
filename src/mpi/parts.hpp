// A rank's region cut once more, at gaps: boxes that lie far apart are searched by a grid each.
//
// One grid over all of them spends its columns on the empty space between: of `clusters` on 32
// ranks it makes 81 comparisons a box, a grid a cluster 36. How many more depends on what else a
// region has, so that no cut evens it out. To deal boxes out costs more time than that, though: see
// Settings::parts. A part is a region as that of a rank is: regions.hpp says why each pair is told
// by one of them, whatever crosses their border.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "mpi/regions.hpp"

namespace throng::mpi {

class Parts {
 public:
  // Which of so many boxes tell where gaps are: one of each run of boxes, and not always the same,
  // as a caller's order may have that period. None of few.
  static std::vector<std::size_t> sample(std::size_t boxes);
  // Cuts the region by the reaches of a sample; none: one part.
  Parts(const Bounds& region, std::vector<Reach> sample);

  std::size_t count() const noexcept { return bounds_.size(); }
  const Bounds& bounds(std::size_t part) const noexcept { return bounds_[part]; }

  // f(part) for each part that is reached, which must not be empty.
  template <class F>
  void visit(const Reach& reach, F&& f) const {
    visit(0, reach, f);
  }
  // The part of each of these, at most `batch`; `several` where it reaches more than one. Most
  // reach one: all go down side by side, as many steps each, with no branch that depends on them.
  static constexpr std::size_t batch = 32;
  static constexpr std::uint32_t several = 0xffffffff;
  void locate(const Reach* reaches, std::size_t count, std::uint32_t* parts) const noexcept;

 private:
  // A part is its own child, and all that comes there lies at or above its cut.
  struct Node {
    Key at = std::numeric_limits<Key>::min();
    std::int32_t axis = 0;
    std::uint32_t child[2];
    std::uint32_t part = 0;
  };

  template <class F>
  void visit(std::uint32_t at, const Reach& reach, F& f) const {
    const Node& node = nodes_[at];
    if (node.child[0] == at) return f(std::size_t{node.part});
    if (reach.lower[node.axis] < node.at) visit(node.child[0], reach, f);
    if (reach.upper[node.axis] >= node.at) visit(node.child[1], reach, f);
  }
  std::uint32_t cut(const Bounds& region, Reach* sample, std::size_t count, int depth);

  std::vector<Node> nodes_;  // the root first
  std::vector<Bounds> bounds_;
  int depth_ = 0;
};

}  // namespace throng::mpi
