// A forest of bounding volume hierarchies: the index for objects that do not suit cells,
// such as many boxes at one place, coordinates of many magnitudes, or unbounded boxes. A search
// visits about log n nodes plus those of the boxes that it finds, for any distribution.
//
// The logarithmic method (Bentley and Saxe, 1980): one large tree, a buffer of a few boxes, and
// trees in between with doubling capacities. Trees are immutable except for erased boxes. New boxes
// go into the buffer or, with the contents of all smaller trees, into the smallest tree with enough
// capacity, which is rebuilt. So a box is moved at most log n times, and no tree degrades as boxes
// move.
//
// Trees are binary. A node is a CellLine with the bounds of its two children. A leaf is a run of
// lines with up to `leaf_objects` boxes. A set is split at the median of that box coordinate, of
// six, with the largest range: this separates shapes and sizes at one place as well as positions.
// Objects whose filter classes differ are split by these first. Each child has a summary of its
// filters, by which searches skip it.
//
// Why no box is lost: the bounds of a node exactly contain those of all boxes below it, as they are
// minima and maxima of floats. If a box overlaps a query, so do all bounds that contain it. What
// contact_interval() and SweepPrefilter accept for a box they accept for any box that
// contains it, no later and for no shorter time.
#pragma once

#include <bit>
#include <cstdint>
#include <utility>

#include <throng/broad_phase.hpp>

#include "base/swept_box.hpp"
#include "tracking/bounds.hpp"
#include "tracking/cell_line.hpp"
#include "tracking/objects.hpp"
#include "tracking/pod_vector.hpp"
#include "tracking/sweep_prefilter.hpp"
#include "tracking/work_counters.hpp"

namespace throng::tracking {

class BvhForest {
 public:
  explicit BvhForest(base::Memory& memory) noexcept;

  // Builds from all active objects and sets their places (Body); those of other objects become
  // `none`, unless they already are (`others_unset`). Throws base::AllocationFailed and is empty
  // then.
  void build(Objects& objects, bool others_unset);
  // Whether this many can be inserted, and at most half of the large tree was erased.
  bool has_capacity_for(std::size_t count) const noexcept;
  // Moves these changed objects in the index, and sets their places; ids may occur
  // twice. has_capacity_for(count) must hold. Throws base::AllocationFailed and then changes
  // nothing.
  void place_all(const Objects& objects, const ObjectId* ids, std::size_t count);

  // Calls f(id) once for each object that overlaps the box; skips many of those that may not pair
  // with `filter`, but not all. Exceptions of f propagate.
  template <class F>
  void search(const Box& box, const Filter& filter, Work& work, F&& f) const;
  // Calls visit(line, k) once for each box k of a line that passes the SweepPrefilter,
  // except those that the sweep meets after time `first`, which visit() may decrease. Visits nearer
  // children first if `to_first`. `cover`: of the sweep.
  template <class Visit>
  void cast(const base::MovingBox& sweep, const base::SweptBounds& cover, const Filter& filter,
            bool to_first, const double& first, Work& work, Visit&& visit) const;

  void reserve_for(const BvhForest& other);
  void copy(const BvhForest& other) noexcept;

 private:
  // A child: consecutive lines of a leaf; or a node, which is one line, with `lines` = 0.
  struct NodeRef {
    std::uint32_t line, lines;
  };
  // Summary of the filters of a set of objects, for a conservative test.
  struct Summary {
    std::uint32_t group, mask;
    std::int32_t owner;  // if common to all, otherwise -1
    std::int32_t min_world, max_world;
    bool everywhere, moving;  // whether any has world -1; whether any is not static

    static Summary of(const Filter& filter) noexcept;
    void add(const Summary& other) noexcept;
    bool may_pair(const Filter& filter) const noexcept;
  };
  struct Item {
    Box box;
    ObjectId id;
    std::uint32_t filters;  // a hash of what it may pair with
  };
  struct Tree {
    std::uint32_t first_line, first_node, capacity;  // capacity: maximum number of objects
    NodeRef root;
    Box bounds;
    std::uint32_t held;    // objects
    std::uint32_t lines;   // in use
    std::uint32_t placed;  // objects in its lines, erased ones included
    bool filtered;         // whether its nodes have summaries
  };
  // Context of a build.
  struct Build;

  static constexpr std::uint32_t leaf_objects = 8, buffer_objects = 16;
  // A reference in 32 bits: the line, and the number of lines, at most 4 for a leaf.
  static constexpr int lines_bits = 3;
  static constexpr std::size_t max_objects = std::size_t{1} << 27;
  static constexpr std::uint32_t max_trees = 32;
  // `next` of a leaf's line; of a node's line it is the node number. Both places of a line count as
  // used.
  static constexpr std::uint32_t leaf_mark = none;
  static CellLine empty_line(std::uint32_t next) noexcept {
    CellLine line = CellLine::empty();
    line.next = next;
    line.used = 2;
    return line;
  }
  // Lines for a tree of this many objects: leaves of 4 to 8 objects, each with at most one empty
  // place, and one node less.
  static constexpr std::size_t lines_for(std::size_t objects) noexcept { return objects + 4; }
  static constexpr std::size_t nodes_for(std::size_t objects) noexcept { return objects / 4 + 1; }

  static std::uint32_t pack(NodeRef ref) noexcept { return ref.line << lines_bits | ref.lines; }
  static NodeRef unpack(std::uint32_t word) noexcept {
    return {word >> lines_bits, word & ((1u << lines_bits) - 1)};
  }
  static Item item_of(const Objects& objects, ObjectId id) noexcept;

  void assign_storage(std::size_t objects);
  void erase(std::uint32_t slot) noexcept;
  // Inserts active objects that are not in the forest, each once.
  void insert(const Objects& objects, const ObjectId* ids, std::size_t count) noexcept;
  void append(const Objects& objects, const Item& item) noexcept;
  void take_all(Tree& tree, const Objects& objects) noexcept;
  void build(Tree& tree, const Objects& objects) noexcept;
  NodeRef split(Build& build, Item* items, std::size_t count, Bounds& bounds,
                Summary& summary) noexcept;
  NodeRef make_leaf(Build& build, const Item* items, std::size_t count, Bounds& bounds,
                    Summary& summary) noexcept;
  void put(const Objects& objects, std::uint32_t line, std::uint32_t k, const Item& item) noexcept;
  void clear(Tree& tree) noexcept;

  PodVector<CellLine> lines_;
  PodVector<Summary> summaries_;  // two per node
  PodVector<Item> items_;         // scratch for builds
  PodVector<ObjectId> entering_;  // scratch: objects to insert
  // The large tree, the buffer, then trees with doubling capacities.
  Tree trees_[max_trees];
  std::uint32_t tree_count_ = 0;
};

inline bool BvhForest::Summary::may_pair(const Filter& f) const noexcept {
  return (group & f.mask) != 0 && (f.group & mask) != 0 && (f.owner == -1 || owner != f.owner) &&
         (f.world == -1 || everywhere || (min_world <= f.world && f.world <= max_world)) &&
         (moving || !f.is_static);
}

template <class F>
void BvhForest::search(const Box& box, const Filter& filter, Work& work, F&& f) const {
  const CellQuery query(box);
  NodeRef stack[2 * max_trees + 2];
  for (std::uint32_t t = 0; t < tree_count_; ++t) {
    const Tree& tree = trees_[t];
    if (tree.held == 0 || !base::overlaps(tree.bounds, box)) continue;
    std::uint32_t depth = 0;
    stack[depth++] = tree.root;
    while (depth != 0) {
      const NodeRef at = stack[--depth];
      if (at.lines == 0) {
        const CellLine& node = lines_[at.line];
        ++work.visited;
        std::uint32_t hits = query.overlaps(node);
        for (; hits != 0; hits &= hits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(hits));
          if (tree.filtered && !summaries_[2 * std::size_t{node.next} + k].may_pair(filter))
            continue;
          const NodeRef child = unpack(node.id[k]);
          base::prefetch(lines_.data() + child.line);
          stack[depth++] = child;
        }
        continue;
      }
      for (std::uint32_t i = at.line; i < at.line + at.lines; ++i) {
        const CellLine& line = lines_[i];
        work.compared += 2;
        const std::uint32_t hits = query.overlaps(line);
        if (hits & 1) f(line.id[0]);
        if (hits & 2) f(line.id[1]);
      }
    }
  }
}

template <class Visit>
void BvhForest::cast(const base::MovingBox& sweep, const base::SweptBounds& cover,
                     const Filter& filter, bool to_first, const double& first, Work& work,
                     Visit&& visit) const {
  struct StackEntry {
    NodeRef ref;
    double enter;
  };
  StackEntry stack[2 * max_trees + 2];
  for (std::uint32_t t = 0; t < tree_count_; ++t) {
    const Tree& tree = trees_[t];
    if (tree.held == 0) continue;
    const base::ContactInterval tree_touch = base::contact_interval(sweep, tree.bounds);
    if (tree_touch.enter > tree_touch.leave || tree_touch.enter > first) continue;
    // No box in the tree is first met later.
    const SweepPrefilter prefilter(sweep.box, cover, tree_touch.leave);
    std::uint32_t depth = 0;
    stack[depth++] = {tree.root, tree_touch.enter};
    while (depth != 0) {
      const StackEntry at = stack[--depth];
      if (at.enter > first) continue;
      if (at.ref.lines == 0) {
        const CellLine& node = lines_[at.ref.line];
        ++work.visited;
        StackEntry child[2];
        std::uint32_t count = 0;
        for (std::uint32_t bits = prefilter.passes(node); bits != 0; bits &= bits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(bits));
          if (tree.filtered && !summaries_[2 * std::size_t{node.next} + k].may_pair(filter))
            continue;
          const base::ContactInterval touch = base::contact_interval(sweep, node.box(k));
          if (touch.enter > touch.leave) continue;
          child[count++] = {unpack(node.id[k]), touch.enter};
          base::prefetch(lines_.data() + child[count - 1].ref.line);
        }
        // The nearer child on top.
        if (count == 2 && to_first && child[0].enter < child[1].enter)
          std::swap(child[0], child[1]);
        for (std::uint32_t k = 0; k < count; ++k) stack[depth++] = child[k];
        continue;
      }
      for (std::uint32_t i = at.ref.line; i < at.ref.line + at.ref.lines; ++i) {
        const CellLine& line = lines_[i];
        work.compared += 2;
        for (std::uint32_t bits = prefilter.passes(line); bits != 0; bits &= bits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(bits));
          if (line.id[k] != none) visit(line, k);
        }
      }
    }
  }
}

}  // namespace throng::tracking
