// A forest of bounding volume hierarchies: the index of objects that cells do not suit, as many
// boxes in one place, coordinates of many magnitudes, or boxes without end. A search visits about
// log n nodes beside the boxes that it finds, wherever the boxes lie.
//
// The logarithmic method (Bentley and Saxe, 1980): one large tree, a buffer of a few boxes, and
// trees between them whose room doubles. None is ever changed but for boxes that are erased. New
// boxes go into the buffer, or with all that is in smaller trees into the smallest tree that has
// room, which is built again. So a box is moved log n times at most, and no tree gets worse as
// boxes move.
//
// A tree is a binary one. A node is a CellLine: the two boxes are the bounds of its children. Up to
// `leaf_objects` boxes make a leaf, which is some lines that follow one another. A set is split in
// two halves, by the corner coordinate of six along which it is widest: boxes of one place but of
// several shapes or sizes are told apart as well as those of several places. Objects whose filters
// differ in what they may pair with are split by that first; and each child has a summary of its
// filters, by which searches pass over whatever they may not find.
//
// Why no box is lost: the bounds of a node hold those of all boxes below it, exactly, as they are
// minima and maxima of floats. Where a box overlaps a query, so do all bounds that hold it; and
// what touch() and LineSieve return for a box they return for one that holds it, no later and no
// shorter.
#pragma once

#include <bit>
#include <cstdint>
#include <utility>

#include <throng/broad_phase.hpp>

#include "core/sweep.hpp"
#include "live/bounds.hpp"
#include "live/cell_line.hpp"
#include "live/list.hpp"
#include "live/objects.hpp"
#include "live/sieve.hpp"
#include "live/work.hpp"

namespace throng::live {

class BvhForest {
 public:
  explicit BvhForest(cpu::Memory& memory) noexcept;

  // Holds all active objects, whose homes become their slots; those of others become `none`, unless
  // they are (`others_are_none`). Throws cpu::NoMemory; then nothing is held.
  void build(Objects& objects, bool others_are_none);
  // Whether so many can be inserted, and most of what is held has not been erased.
  bool takes(std::size_t count) const noexcept;
  void erase(std::uint32_t slot) noexcept;
  // Objects that are active and not held, each once; it takes so many. Their homes become their
  // slots.
  void insert(const Objects& objects, const ObjectId* ids, std::size_t count) noexcept;

  // f(id) for each object that overlaps the box, once; of those that `filter` may not pair with it
  // leaves out many. What f throws comes through.
  template <class F>
  void search(const Box& box, const Filter& filter, Work& work, F&& f) const;
  // look(line, k) for box k of a line, all that pass a sieve, each once; but those that the sweep
  // meets after time `first`, which look() may make less. Nearer ones go first if only the first is
  // wanted. `cover`: the sweep's.
  template <class Look>
  void cast(const Sweep& sweep, const core::Cover& cover, const Filter& filter, bool to_first,
            const double& first, Work& work, Look&& look) const;

  void reserve_for(const BvhForest& other);
  void copy(const BvhForest& other) noexcept;

 private:
  // Lines that follow one another: a leaf; or a node, which has none and is a line itself.
  struct Ref {
    std::uint32_t line, lines;
  };
  // What is known of the filters of a set of objects.
  struct Summary {
    std::uint32_t group, mask;
    std::int32_t owner;  // of all of them, or -1
    std::int32_t least_world, greatest_world;
    bool everywhere, moving;  // whether one is of world -1; is not static

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
    std::uint32_t first_line, first_node, room;  // room for so many objects
    Ref root;
    Box bounds;
    std::uint32_t held;    // objects
    std::uint32_t lines;   // in use
    std::uint32_t placed;  // objects ever put into its lines
    bool filtered;         // whether its nodes have summaries
  };
  // What a tree is built from.
  struct Build;

  static constexpr std::uint32_t leaf_objects = 8, buffer_objects = 16;
  // A reference to a child, in a word: its line and how many lines it has, of which a leaf has at
  // most 4.
  static constexpr int lines_bits = 3;
  static constexpr std::size_t most_objects = std::size_t{1} << 27;
  static constexpr std::uint32_t most_trees = 32;
  // `next` of a line of a leaf; that of a node is its number. Both places of a line count as used.
  static constexpr std::uint32_t of_leaf = none;
  static CellLine empty_line(std::uint32_t next) noexcept {
    CellLine line = CellLine::empty();
    line.next = next;
    line.used = 2;
    return line;
  }
  // Lines of a tree of so many objects: leaves of 4 to 8 objects, each with half a line that may be
  // empty, and one node less.
  static constexpr std::size_t lines_for(std::size_t objects) noexcept { return objects + 4; }
  static constexpr std::size_t nodes_for(std::size_t objects) noexcept { return objects / 4 + 1; }

  static std::uint32_t pack(Ref ref) noexcept { return ref.line << lines_bits | ref.lines; }
  static Ref unpack(std::uint32_t word) noexcept {
    return {word >> lines_bits, word & ((1u << lines_bits) - 1)};
  }
  static Item item_of(const Objects& objects, ObjectId id) noexcept;

  void lay_out(std::size_t objects);
  void append(const Objects& objects, const Item& item) noexcept;
  void gather(Tree& tree, const Objects& objects) noexcept;
  void build(Tree& tree, const Objects& objects) noexcept;
  Ref split(Build& build, Item* items, std::size_t count, Bounds& bounds,
            Summary& summary) noexcept;
  Ref make_leaf(Build& build, const Item* items, std::size_t count, Bounds& bounds,
                Summary& summary) noexcept;
  void put(const Objects& objects, std::uint32_t line, std::uint32_t k, const Item& item) noexcept;
  void clear(Tree& tree) noexcept;

  List<CellLine> lines_;
  List<Summary> summaries_;  // two a node
  List<Item> items_;         // room to build
  // The large one, the buffer, and from there on each has room for twice as many.
  Tree trees_[most_trees];
  std::uint32_t tree_count_ = 0;
};

inline bool BvhForest::Summary::may_pair(const Filter& f) const noexcept {
  return (group & f.mask) != 0 && (f.group & mask) != 0 && (f.owner == -1 || owner != f.owner) &&
         (f.world == -1 || everywhere || (least_world <= f.world && f.world <= greatest_world)) &&
         (moving || !f.is_static);
}

template <class F>
void BvhForest::search(const Box& box, const Filter& filter, Work& work, F&& f) const {
  const CellQuery query(box);
  Ref stack[2 * most_trees + 2];
  for (std::uint32_t t = 0; t < tree_count_; ++t) {
    const Tree& tree = trees_[t];
    if (tree.held == 0 || !core::overlaps(tree.bounds, box)) continue;
    std::uint32_t depth = 0;
    stack[depth++] = tree.root;
    while (depth != 0) {
      const Ref at = stack[--depth];
      if (at.lines == 0) {
        const CellLine& node = lines_[at.line];
        ++work.visited;
        std::uint32_t hits = query.overlaps(node);
        for (; hits != 0; hits &= hits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(hits));
          if (tree.filtered && !summaries_[2 * std::size_t{node.next} + k].may_pair(filter))
            continue;
          const Ref child = unpack(node.id[k]);
          cpu::prefetch(lines_.data() + child.line);
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

template <class Look>
void BvhForest::cast(const Sweep& sweep, const core::Cover& cover, const Filter& filter,
                     bool to_first, const double& first, Work& work, Look&& look) const {
  struct Later {
    Ref ref;
    double enter;
  };
  Later stack[2 * most_trees + 2];
  for (std::uint32_t t = 0; t < tree_count_; ++t) {
    const Tree& tree = trees_[t];
    if (tree.held == 0) continue;
    const core::Touch whole = core::touch(sweep, tree.bounds);
    if (whole.enter > whole.leave || whole.enter > first) continue;
    // Nothing in the tree begins to be met later.
    const LineSieve sieve(SieveTerms(sweep, cover, whole.leave));
    std::uint32_t depth = 0;
    stack[depth++] = {tree.root, whole.enter};
    while (depth != 0) {
      const Later at = stack[--depth];
      if (at.enter > first) continue;
      if (at.ref.lines == 0) {
        const CellLine& node = lines_[at.ref.line];
        ++work.visited;
        Later child[2];
        std::uint32_t count = 0;
        for (std::uint32_t bits = sieve.passes(node); bits != 0; bits &= bits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(bits));
          if (tree.filtered && !summaries_[2 * std::size_t{node.next} + k].may_pair(filter))
            continue;
          const core::Touch touch = core::touch(sweep, node.box(k));
          if (touch.enter > touch.leave) continue;
          child[count++] = {unpack(node.id[k]), touch.enter};
          cpu::prefetch(lines_.data() + child[count - 1].ref.line);
        }
        // The nearer one is on top.
        if (count == 2 && to_first && child[0].enter < child[1].enter)
          std::swap(child[0], child[1]);
        for (std::uint32_t k = 0; k < count; ++k) stack[depth++] = child[k];
        continue;
      }
      for (std::uint32_t i = at.ref.line; i < at.ref.line + at.ref.lines; ++i) {
        const CellLine& line = lines_[i];
        work.compared += 2;
        for (std::uint32_t bits = sieve.passes(line); bits != 0; bits &= bits - 1) {
          const auto k = static_cast<std::uint32_t>(std::countr_zero(bits));
          if (line.id[k] != none) look(line, k);
        }
      }
    }
  }
}

}  // namespace throng::live
