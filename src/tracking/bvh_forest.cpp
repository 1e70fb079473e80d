#include "tracking/bvh_forest.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/bounds.hpp"

namespace throng::tracking {
namespace {

constexpr Box empty_bounds = {{1, 1, 1}, {-1, -1, -1}};

// One of the six consecutive coordinates of a box.
float coordinate(const Box& box, int i) noexcept {
  static_assert(sizeof(Box) == 6 * sizeof(float));
  return reinterpret_cast<const float*>(&box)[i];
}

// The coordinate, of six, with the largest range.
class Widest {
 public:
  void add(const Box& box) noexcept {
    for (int k = 0; k < 6; ++k) {
      const float x = coordinate(box, k);
      min_[k] = x < min_[k] ? x : min_[k];
      max_[k] = x > max_[k] ? x : max_[k];
    }
  }
  int coordinate_number() const noexcept {
    int widest = 0;
    double most = -1;
    for (int k = 0; k < 6; ++k) {
      const double width =
          double{base::clamp_finite(max_[k])} - double{base::clamp_finite(min_[k])};
      if (width > most) widest = k;
      most = std::max(most, width);
    }
    return widest;
  }

 private:
  static constexpr float far = std::numeric_limits<float>::infinity();
  float min_[6] = {far, far, far, far, far, far};
  float max_[6] = {-far, -far, -far, -far, -far, -far};
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
  min_world = std::min(min_world, other.min_world);
  max_world = std::max(max_world, other.max_world);
  everywhere |= other.everywhere;
  moving |= other.moving;
}

struct BvhForest::Build {
  Tree& tree;
  const Objects& objects;
  std::uint32_t node;  // number of the next node
};

// The first tree_count_ of trees_ are set.
// cppcheck-suppress uninitMemberVar
BvhForest::BvhForest(base::Memory& memory) noexcept
    : lines_(memory), summaries_(memory), items_(memory), entering_(memory) {}

BvhForest::Item BvhForest::item_of(const Objects& objects, ObjectId id) noexcept {
  return {objects.expanded(id), id, objects.has_filters() ? objects.pairing_class(id) : 0};
}

// Lays out, empty, the large tree, the buffer, and trees for a quarter of the objects.
void BvhForest::assign_storage(std::size_t objects) {
  tree_count_ = 0;
  if (objects > max_objects) throw base::AllocationFailed{};
  std::size_t lines = 0, nodes = 0;
  const auto add = [&](std::size_t capacity) {
    trees_[tree_count_++] = {static_cast<std::uint32_t>(lines),
                             static_cast<std::uint32_t>(nodes),
                             static_cast<std::uint32_t>(capacity),
                             {0, 0},
                             empty_bounds,
                             0,
                             0,
                             0,
                             false};
    lines += lines_for(capacity);
    nodes += nodes_for(capacity);
  };
  add(objects);
  std::size_t capacity = buffer_objects;
  for (; capacity < objects / 4; capacity *= 2) add(capacity);
  add(capacity);
  const std::uint32_t count = std::exchange(tree_count_, 0);
  lines_.reserve_discard(lines);
  summaries_.reserve_discard(2 * nodes);
  items_.reserve_discard(std::max(objects, 2 * capacity));
  lines_.resize(lines);
  summaries_.resize(2 * nodes);
  tree_count_ = count;
}

void BvhForest::build(Objects& objects, bool others_unset) {
  const bool listed = others_unset && objects.sparse();
  if (listed) objects.list_alive();
  assign_storage(objects.count());
  const auto take = [&](ObjectId id) {
    objects.body(id).bucket = none;
    if (objects.is_active(id)) items_.push(item_of(objects, id));
  };
  if (listed) {
    for (const ObjectId id : objects.alive_ids()) take(id);
  } else {
    for (std::size_t id = 0; id < objects.limit(); ++id) take(static_cast<ObjectId>(id));
  }
  build(trees_[0], objects);
}

bool BvhForest::has_capacity_for(std::size_t count) const noexcept {
  if (tree_count_ == 0) return false;
  std::size_t held = 0;
  for (std::uint32_t t = 1; t < tree_count_; ++t) held += trees_[t].held;
  return held + count <= trees_[tree_count_ - 1].capacity && 2 * trees_[0].held >= trees_[0].placed;
}

void BvhForest::place_all(const Objects& objects, const ObjectId* ids, std::size_t count) {
  constexpr std::uint32_t queued = none - 1;
  entering_.reserve_discard(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t& place = objects.body(ids[i]).bucket;
    if (place == queued) continue;
    if (place != none) erase(place);
    place = none;
    if (!objects.is_active(ids[i])) continue;
    place = queued;
    entering_.push(ids[i]);
  }
  insert(objects, entering_.data(), entering_.size());
}

void BvhForest::put(const Objects& objects, std::uint32_t line, std::uint32_t k,
                    const Item& item) noexcept {
  lines_[line].set(k, item.box);
  lines_[line].id[k] = item.id;
  objects.body(item.id).bucket = 2 * line + k;
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
  tree.bounds = empty_bounds;
}

void BvhForest::insert(const Objects& objects, const ObjectId* ids, std::size_t count) noexcept {
  if (count == 0) return;
  Tree& buffer = trees_[1];
  if (buffer.placed + count <= buffer_objects) {
    for (std::size_t i = 0; i < count; ++i) append(objects, item_of(objects, ids[i]));
    return;
  }
  std::uint32_t t = 1;
  for (std::size_t held = trees_[1].held; held + count > trees_[t].capacity; held += trees_[t].held)
    ++t;
  items_.clear();
  for (std::uint32_t smaller = 1; smaller <= t; ++smaller) take_all(trees_[smaller], objects);
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
  if (k == 0) lines_[line] = empty_line(leaf_mark);
  put(objects, line, k, item);
  Bounds bounds;
  if (buffer.held != 0) bounds.extend(buffer.bounds);
  bounds.extend(item.box);
  buffer.bounds = bounds.box();
  ++buffer.held;
  ++buffer.placed;
  buffer.lines = (buffer.placed + 1) / 2;
  buffer.root = {buffer.first_line, buffer.lines};
  buffer.filtered = false;
}

// Moves the contents of a tree to items_.
void BvhForest::take_all(Tree& tree, const Objects& objects) noexcept {
  for (std::uint32_t i = tree.first_line; i < tree.first_line + tree.lines; ++i) {
    const CellLine& line = lines_[i];
    if (line.next != leaf_mark) continue;
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

BvhForest::NodeRef BvhForest::make_leaf(Build& build, const Item* items, std::size_t count,
                                        Bounds& bounds, Summary& summary) noexcept {
  Tree& tree = build.tree;
  const NodeRef leaf{tree.first_line + tree.lines, static_cast<std::uint32_t>((count + 1) / 2)};
  tree.lines += leaf.lines;
  std::fill_n(lines_.begin() + leaf.line, leaf.lines, empty_line(leaf_mark));
  for (std::uint32_t i = 0; i < count; ++i) {
    put(build.objects, leaf.line + i / 2, i % 2, items[i]);
    bounds.extend(items[i].box);
    if (!tree.filtered) continue;
    const Summary one = Summary::of(build.objects.filter(items[i].id));
    if (i == 0)
      summary = one;
    else
      summary.add(one);
  }
  return leaf;
}

BvhForest::NodeRef BvhForest::split(Build& build, Item* items, std::size_t count, Bounds& bounds,
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
  const NodeRef node{tree.first_line + tree.lines++, 0};
  const std::uint32_t number = build.node++;
  CellLine line = empty_line(number);
  for (std::uint32_t k = 0; k < 2; ++k) {
    Bounds child_bounds;
    Summary child_summary{};
    const NodeRef child =
        k == 0 ? split(build, items, half, child_bounds, child_summary)
               : split(build, items + half, count - half, child_bounds, child_summary);
    line.set(k, child_bounds.box());
    line.id[k] = pack(child);
    bounds.extend(child_bounds);
    if (!tree.filtered) continue;
    summaries_[2 * std::size_t{number} + k] = child_summary;
    if (k == 0)
      summary = child_summary;
    else
      summary.add(child_summary);
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

}  // namespace throng::tracking
