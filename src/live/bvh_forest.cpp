#include "live/bvh_forest.hpp"

#include <algorithm>
#include <cfloat>
#include <limits>
#include <utility>

namespace throng::live {
namespace {

constexpr Box no_bounds = {{1, 1, 1}, {-1, -1, -1}};

// One of the six consecutive coordinates of a box.
float coordinate(const Box& box, int i) noexcept {
  static_assert(sizeof(Box) == 6 * sizeof(float));
  return reinterpret_cast<const float*>(&box)[i];
}
double finite(float x) noexcept { return std::clamp(x, -FLT_MAX, FLT_MAX); }

// The coordinate, of six, with the largest range.
class Widest {
 public:
  void add(const Box& box) noexcept {
    for (int k = 0; k < 6; ++k) {
      const float x = coordinate(box, k);
      least_[k] = x < least_[k] ? x : least_[k];
      greatest_[k] = x > greatest_[k] ? x : greatest_[k];
    }
  }
  int coordinate_number() const noexcept {
    int widest = 0;
    double most = -1;
    for (int k = 0; k < 6; ++k) {
      const double width = finite(greatest_[k]) - finite(least_[k]);
      if (width > most) widest = k;
      most = std::max(most, width);
    }
    return widest;
  }

 private:
  static constexpr float far = std::numeric_limits<float>::infinity();
  float least_[6] = {far, far, far, far, far, far};
  float greatest_[6] = {-far, -far, -far, -far, -far, -far};
};

}  // namespace

BvhForest::Summary BvhForest::Summary::of(const Filter& f) noexcept {
  constexpr std::int32_t least = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t greatest = std::numeric_limits<std::int32_t>::max();
  const bool in_world = f.world != -1;
  return {
      f.group,   f.mask,      f.owner, in_world ? f.world : greatest, in_world ? f.world : least,
      !in_world, !f.is_static};
}

void BvhForest::Summary::add(const Summary& other) noexcept {
  group |= other.group;
  mask |= other.mask;
  if (owner != other.owner) owner = -1;
  least_world = std::min(least_world, other.least_world);
  greatest_world = std::max(greatest_world, other.greatest_world);
  everywhere |= other.everywhere;
  moving |= other.moving;
}

struct BvhForest::Build {
  Tree& tree;
  const Objects& objects;
  std::uint32_t node;  // number of the next node
};

BvhForest::BvhForest(cpu::Memory& memory) noexcept
    : lines_(memory), summaries_(memory), items_(memory) {}

BvhForest::Item BvhForest::item_of(const Objects& objects, ObjectId id) noexcept {
  return {objects.grown(id), id, objects.has_filters() ? objects.pairing_class(id) : 0};
}

// Lays out, empty, the large tree, the buffer, and trees for a quarter of the objects.
void BvhForest::lay_out(std::size_t objects) {
  tree_count_ = 0;
  if (objects > most_objects) throw cpu::NoMemory{};
  std::size_t lines = 0, nodes = 0;
  const auto add = [&](std::size_t room) {
    trees_[tree_count_++] = {static_cast<std::uint32_t>(lines),
                             static_cast<std::uint32_t>(nodes),
                             static_cast<std::uint32_t>(room),
                             {0, 0},
                             no_bounds,
                             0,
                             0,
                             0,
                             false};
    lines += lines_for(room);
    nodes += nodes_for(room);
  };
  add(objects);
  std::size_t room = buffer_objects;
  for (; room < objects / 4; room *= 2) add(room);
  add(room);
  const std::uint32_t count = std::exchange(tree_count_, 0);
  lines_.renew(lines);
  summaries_.renew(2 * nodes);
  items_.renew(std::max(objects, 2 * room));
  lines_.resize(lines);
  summaries_.resize(2 * nodes);
  tree_count_ = count;
}

void BvhForest::build(Objects& objects, bool others_are_none) {
  const bool listed = others_are_none && objects.sparse();
  if (listed) objects.list_alive();
  lay_out(objects.count());
  const auto take = [&](ObjectId id) {
    objects.body(id).home = none;
    if (objects.is_active(id)) items_.push(item_of(objects, id));
  };
  if (listed) {
    for (const ObjectId id : objects.alive_ids()) take(id);
  } else {
    for (std::size_t id = 0; id < objects.limit(); ++id) take(static_cast<ObjectId>(id));
  }
  build(trees_[0], objects);
}

bool BvhForest::takes(std::size_t count) const noexcept {
  if (tree_count_ == 0) return false;
  std::size_t held = 0;
  for (std::uint32_t t = 1; t < tree_count_; ++t) held += trees_[t].held;
  return held + count <= trees_[tree_count_ - 1].room && 2 * trees_[0].held >= trees_[0].placed;
}

void BvhForest::put(const Objects& objects, std::uint32_t line, std::uint32_t k,
                    const Item& item) noexcept {
  lines_[line].set(k, item.box);
  lines_[line].id[k] = item.id;
  objects.body(item.id).home = 2 * line + k;
}

void BvhForest::erase(std::uint32_t slot) noexcept {
  std::uint32_t t = 0;
  while (t + 1 < tree_count_ && trees_[t + 1].first_line <= slot / 2) ++t;
  CellLine& line = lines_[slot / 2];
  for (auto& corner : line.corner) corner[slot % 2] = std::numeric_limits<float>::quiet_NaN();
  line.id[slot % 2] = none;
  if (--trees_[t].held == 0) clear(trees_[t]);
}

void BvhForest::clear(Tree& tree) noexcept {
  tree.held = tree.lines = tree.placed = 0;
  tree.bounds = no_bounds;
}

void BvhForest::insert(const Objects& objects, const ObjectId* ids, std::size_t count) noexcept {
  if (count == 0) return;
  Tree& buffer = trees_[1];
  if (buffer.placed + count <= buffer_objects) {
    for (std::size_t i = 0; i < count; ++i) append(objects, item_of(objects, ids[i]));
    return;
  }
  std::uint32_t t = 1;
  for (std::size_t held = trees_[1].held; held + count > trees_[t].room; held += trees_[t].held)
    ++t;
  items_.clear();
  for (std::uint32_t smaller = 1; smaller <= t; ++smaller) gather(trees_[smaller], objects);
  for (std::size_t i = 0; i < count; ++i) items_.push(item_of(objects, ids[i]));
  if (t != 1) {
    build(trees_[t], objects);
    return;
  }
  for (const Item& item : items_) append(objects, item);
}

// Appends to the buffer, which is one leaf of many lines.
void BvhForest::append(const Objects& objects, const Item& item) noexcept {
  Tree& buffer = trees_[1];
  const std::uint32_t line = buffer.first_line + buffer.placed / 2, k = buffer.placed % 2;
  if (k == 0) lines_[line] = empty_line(of_leaf);
  put(objects, line, k, item);
  Bounds bounds;
  if (buffer.held != 0) bounds.hold(buffer.bounds);
  bounds.hold(item.box);
  buffer.bounds = bounds.box();
  ++buffer.held;
  ++buffer.placed;
  buffer.lines = (buffer.placed + 1) / 2;
  buffer.root = {buffer.first_line, buffer.lines};
  buffer.filtered = false;
}

// Moves the contents of a tree to items_.
void BvhForest::gather(Tree& tree, const Objects& objects) noexcept {
  for (std::uint32_t i = tree.first_line; i < tree.first_line + tree.lines; ++i) {
    const CellLine& line = lines_[i];
    if (line.next != of_leaf) continue;
    for (const ObjectId id : line.id) {
      if (id != none) items_.push(item_of(objects, id));
    }
  }
  clear(tree);
}

// Builds from items_.
void BvhForest::build(Tree& tree, const Objects& objects) noexcept {
  clear(tree);
  tree.filtered = objects.has_filters();
  tree.held = tree.placed = static_cast<std::uint32_t>(items_.size());
  if (items_.empty()) return;
  Build build{tree, objects, tree.first_node};
  Bounds bounds;
  Summary summary;
  tree.root = split(build, items_.data(), items_.size(), bounds, summary);
  tree.bounds = bounds.box();
}

BvhForest::Ref BvhForest::make_leaf(Build& build, const Item* items, std::size_t count,
                                    Bounds& bounds, Summary& summary) noexcept {
  Tree& tree = build.tree;
  const Ref leaf{tree.first_line + tree.lines, static_cast<std::uint32_t>((count + 1) / 2)};
  tree.lines += leaf.lines;
  std::fill_n(lines_.begin() + leaf.line, leaf.lines, empty_line(of_leaf));
  for (std::uint32_t i = 0; i < count; ++i) {
    put(build.objects, leaf.line + i / 2, i % 2, items[i]);
    bounds.hold(items[i].box);
    if (!tree.filtered) continue;
    const Summary one = Summary::of(build.objects.filter(items[i].id));
    if (i == 0)
      summary = one;
    else
      summary.add(one);
  }
  return leaf;
}

BvhForest::Ref BvhForest::split(Build& build, Item* items, std::size_t count, Bounds& bounds,
                                Summary& summary) noexcept {
  if (count <= leaf_objects) return make_leaf(build, items, count, bounds, summary);
  Widest widest;
  bool one_class = true;
  for (std::size_t i = 0; i < count; ++i) {
    widest.add(items[i].box);
    one_class &= items[i].filters == items[0].filters;
  }
  const std::size_t half = count / 2;
  if (one_class) {
    std::nth_element(items, items + half, items + count,
                     [k = widest.coordinate_number()](const Item& a, const Item& b) {
                       return coordinate(a.box, k) < coordinate(b.box, k);
                     });
  } else {
    std::nth_element(items, items + half, items + count,
                     [](const Item& a, const Item& b) { return a.filters < b.filters; });
  }
  Tree& tree = build.tree;
  const Ref node{tree.first_line + tree.lines++, 0};
  const std::uint32_t number = build.node++;
  CellLine line = empty_line(number);
  for (std::uint32_t k = 0; k < 2; ++k) {
    Bounds of_child;
    Summary known{};
    const Ref child = k == 0 ? split(build, items, half, of_child, known)
                             : split(build, items + half, count - half, of_child, known);
    line.set(k, of_child.box());
    line.id[k] = pack(child);
    bounds.hold(of_child);
    if (!tree.filtered) continue;
    summaries_[2 * std::size_t{number} + k] = known;
    if (k == 0)
      summary = known;
    else
      summary.add(known);
  }
  lines_[node.line] = line;
  return node;
}

void BvhForest::reserve_for(const BvhForest& other) {
  lines_.match(other.lines_);
  summaries_.match(other.summaries_);
  items_.match(other.items_);
}

void BvhForest::copy(const BvhForest& other) noexcept {
  lines_.copy(other.lines_);
  summaries_.copy(other.summaries_);
  std::copy(other.trees_, other.trees_ + other.tree_count_, trees_);
  tree_count_ = other.tree_count_;
}

}  // namespace throng::live
