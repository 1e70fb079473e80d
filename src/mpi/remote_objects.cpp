#include "mpi/remote_objects.hpp"

#include <algorithm>

#include "mpi/balance.hpp"

namespace throng::mpi {
namespace {

Options for_search(Options options) noexcept {
  options.nan = NanPolicy::inactive;  // NaNs were refused before sending
  options.order = Order::any;
  return options;
}

// The filters of an array of structures, each with a Filter at `first`.
Filters filters_at(const Filter* first, std::size_t count, std::size_t stride) noexcept {
  return {{&first->group, count, stride},
          {&first->mask, count, stride},
          {&first->owner, count, stride},
          {&first->world, count, stride},
          {&first->is_static, count, stride}};
}

}  // namespace

bool same(const Filter& a, const Filter& b) noexcept {
  return a.group == b.group && a.mask == b.mask && a.owner == b.owner && a.world == b.world &&
         a.is_static == b.is_static;
}

RemoteObjects::RemoteObjects(const Options& options, float margin)
    : search_(for_search(options)), margin_(margin) {}

void RemoteObjects::take(const Move& move) {
  moved_.push_back(objects_.at(move.id));
  boxes_.push_back(move.now);
}

void RemoteObjects::take(const Change& c, const Bounds& here_before, const Bounds& here) {
  const bool was = c.was_alive && here_before.meets(key_box_of(c.before, margin_));
  const bool is = c.is_alive && here.meets(key_box_of(c.now, margin_));
  if (!was && !is) return;
  if (!was) {
    (c.was_alive ? entering_ : created_).push_back(c);
    return;
  }
  const ObjectId object = objects_.at(c.id);
  if (!c.is_alive) {
    removed_.push_back(object);
    return;
  }
  moved_.push_back(object);
  boxes_.push_back(c.now);
  if (!same(c.filter_before, c.filter)) {
    filtered_.push_back(object);
    filters_.push_back(c.filter);
  }
  if (!is) leaving_.push_back(object);
}

void RemoteObjects::name(ObjectId object, std::uint64_t id, const Box& box) {
  if (object >= ids_.size()) {
    ids_.resize(object + std::size_t{1});
    corners_.resize(ids_.size());
    corners_before_.resize(ids_.size());
  }
  const KeyBox key_box = key_box_of(box, margin_);
  ids_[object] = id;
  for (int k = 0; k < 3; ++k) corners_[object].at[k] = key_box.lower[k];
  objects_.insert_or_assign(id, object);
}

Result RemoteObjects::apply_entering() {
  Result r;
  if (entering_.empty()) return r;
  std::vector<ObjectId> objects(entering_.size());
  Boxes boxes(&entering_[0].before, entering_.size(), sizeof(Change));
  boxes.filters = filters_at(&entering_[0].filter_before, entering_.size(), sizeof(Change));
  r = search_.add(boxes, objects.data());
  if (!r.ok()) return r;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Change& c = entering_[i];
    name(objects[i], c.id, c.before);
    moved_.push_back(objects[i]);
    boxes_.push_back(c.now);
    if (!same(c.filter_before, c.filter)) {
      filtered_.push_back(objects[i]);
      filters_.push_back(c.filter);
    }
  }
  return search_.update();
}

Result RemoteObjects::apply_changes() {
  // Outside an update both corner arrays are equal; only the objects changed here will differ.
  for (const ObjectId object : moved_) corners_before_[object] = corners_[object];
  for (const ObjectId object : removed_) corners_before_[object] = corners_[object];
  Result r = search_.move(moved_.data(), boxes_);
  if (!r.ok()) return r;
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    const KeyBox key_box = key_box_of(boxes_[i], margin_);
    for (int k = 0; k < 3; ++k) corners_[moved_[i]].at[k] = key_box.lower[k];
  }
  if (!filtered_.empty()) {
    r = search_.set_filters(filtered_.data(), filtered_.size(),
                            filters_at(filters_.data(), filters_.size(), sizeof(Filter)));
    if (!r.ok()) return r;
  }
  r = search_.remove(removed_.data(), removed_.size());
  if (!r.ok()) return r;
  if (!created_.empty()) {
    std::vector<ObjectId> objects(created_.size());
    Boxes boxes(&created_[0].now, created_.size(), sizeof(Change));
    boxes.filters = filters_at(&created_[0].filter, created_.size(), sizeof(Change));
    r = search_.add(boxes, objects.data());
    if (!r.ok()) return r;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      name(objects[i], created_[i].id, created_[i].now);
      corners_before_[objects[i]] = corners_[objects[i]];
    }
  }
  return search_.update();
}

Result RemoteObjects::drop_leaving() {
  Result r;
  if (leaving_.empty()) return r;
  r = search_.remove(leaving_.data(), leaving_.size());
  return r.ok() ? search_.update() : r;
}

bool RemoteObjects::owns_pair(ObjectId a, ObjectId b, const std::vector<Corner>& corners,
                              const Bounds& here) const noexcept {
  for (int k = 0; k < 3; ++k) {
    const Key corner = std::max(corners[a].at[k], corners[b].at[k]);
    if (corner < here.lower[k] || corner >= here.upper[k]) return false;
  }
  return true;
}

Pair64 RemoteObjects::ids_of(const LivePair& pair) const noexcept {
  const std::uint64_t a = ids_[pair.first], b = ids_[pair.second];
  return {std::min(a, b), std::max(a, b)};
}

Result RemoteObjects::update(const Bounds& here_before, const Bounds& here,
                             std::vector<Pair64>& begun, std::vector<Pair64>& ended) {
  Result r = apply_entering();
  if (r.ok()) r = apply_changes();
  if (!r.ok()) return r;
  for (const LivePair& pair : search_.begun()) {
    if (owns_pair(pair.first, pair.second, corners_, here)) begun.push_back(ids_of(pair));
  }
  for (const LivePair& pair : search_.ended()) {
    if (owns_pair(pair.first, pair.second, corners_before_, here_before)) {
      ended.push_back(ids_of(pair));
    }
  }
  std::sort(begun.begin(), begun.end());
  std::sort(ended.begin(), ended.end());
  const Result update_result = r;
  r = drop_leaving();
  if (!r.ok()) return r;
  for (const ObjectId object : moved_) corners_before_[object] = corners_[object];
  for (const ObjectId object : removed_) objects_.erase(ids_[object]);
  for (const ObjectId object : leaving_) objects_.erase(ids_[object]);
  entering_.clear();
  created_.clear();
  moved_.clear();
  boxes_.clear();
  filtered_.clear();
  filters_.clear();
  removed_.clear();
  leaving_.clear();
  return update_result;
}

void RemoteObjects::pairs(const Bounds& here, std::vector<Pair64>& out) {
  out.clear();
  for (const LivePair& pair : search_.pairs()) {
    if (owns_pair(pair.first, pair.second, corners_, here)) out.push_back(ids_of(pair));
  }
  std::sort(out.begin(), out.end());
}

std::size_t RemoteObjects::owned_count(const Bounds& here) const noexcept {
  std::size_t count = 0;
  for (const auto& [id, object] : objects_) count += owns_pair(object, object, corners_, here);
  return count;
}

// Sorted by id, so that the sampled points are the same in every run.
void RemoteObjects::points(const Bounds& here, std::vector<Point>& out) {
  std::vector<std::uint32_t> halves(ids_.size());
  for (const LivePair& pair : search_.pairs()) {
    ++halves[pair.first];
    ++halves[pair.second];
  }
  std::vector<std::pair<std::uint64_t, ObjectId>> owned;
  for (const auto& [id, object] : objects_) {
    if (owns_pair(object, object, corners_, here)) owned.emplace_back(id, object);
  }
  std::sort(owned.begin(), owned.end());
  const std::uint64_t shared = owned.empty() ? 0 : work_of(size(), 0, 0) / owned.size();
  for (const auto& [id, object] : owned) {
    const Corner& c = corners_[object];
    add_point(out, {{c.at[0], c.at[1], c.at[2]}, {c.at[0], c.at[1], c.at[2]}},
              shared + halves[object] * pair_work / 2);
  }
}

}  // namespace throng::mpi
