#include "device/emulated_broad_phase.hpp"

#include "device/discrete_device.hpp"
#include "device/persistent_scene.hpp"

namespace throng::tests {

struct EmulatedBroadPhase::Scene : device::PersistentScene<device::DiscreteDevice> {
  using PersistentScene::PersistentScene;
};

EmulatedBroadPhase::EmulatedBroadPhase(const Options& options, float fat_margin,
                                       std::pmr::memory_resource* memory)
    : scene_(std::make_unique<Scene>(fat_margin, options, memory)) {}
EmulatedBroadPhase::~EmulatedBroadPhase() = default;

template <class F>
Result EmulatedBroadPhase::call(const F& f) {
  Result r;
  try {
    f(r);
  } catch (const device::Failure& failure) {
    r.status = failure.status;
    r.bytes_needed = failure.bytes;
  }
  return r;
}

Result EmulatedBroadPhase::add(const Boxes& boxes, ObjectId* ids) {
  return call([&](Result& r) { scene_->add(boxes, ids, r); });
}
Result EmulatedBroadPhase::remove(const ObjectId* ids, std::size_t count) {
  return call([&](Result& r) { scene_->remove(ids, count, r); });
}
Result EmulatedBroadPhase::move(const ObjectId* ids, const Boxes& boxes) {
  return call([&](Result& r) { scene_->move(ids, boxes, r); });
}
Result EmulatedBroadPhase::move_all(const Boxes& boxes) {
  if (!combined_) return call([&](Result& r) { scene_->move_all(boxes, r); });
  all_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) all_.push_back(boxes[i]);
  given_ = true;
  Result r;
  r.found = object_count();
  return r;
}
Result EmulatedBroadPhase::set_filters(const ObjectId* ids, std::size_t count,
                                       const Filters& filters) {
  return call([&](Result& r) { scene_->set_filters(ids, count, filters, r); });
}
Result EmulatedBroadPhase::shift_origin(const Vec3& by) {
  return call([&](Result& r) { scene_->shift_origin(by, r); });
}
Result EmulatedBroadPhase::update() {
  const Boxes boxes(all_.data(), all_.size());
  const Result r = call([&](Result& result) { scene_->update(given_ ? &boxes : nullptr, result); });
  given_ = given_ && r.status == Status::out_of_memory;  // again, with the same boxes
  reason_ = r.plan.reason;
  return r;
}
Result EmulatedBroadPhase::copy_from(const EmulatedBroadPhase& other) {
  return call([&](Result&) { scene_->copy(*other.scene_); });
}
Result EmulatedBroadPhase::find_overlaps(const Boxes& boxes) {
  return call([&](Result& r) { scene_->find_overlaps(boxes, r); });
}
Result EmulatedBroadPhase::find_hits(const Sweep* sweeps, std::size_t count, SweepHits which,
                                     const Filters& filters, const SweepTest&) {
  return call([&](Result& r) {
    scene_->find_hits(device::QueryBatch::of_sweeps(sweeps, count, filters), which, r);
  });
}
Result EmulatedBroadPhase::find_first_hits(const Sweep* sweeps, std::size_t count,
                                           const Filters& filters, SweepHit* out) {
  return call([&](Result& r) {
    scene_->find_first_hits(device::QueryBatch::of_sweeps(sweeps, count, filters), out, r);
  });
}
Pairs EmulatedBroadPhase::overlaps() const { return scene_->queries().overlaps(); }
SweepHitList EmulatedBroadPhase::hits() const { return scene_->queries().hits(); }

LivePairs EmulatedBroadPhase::begun() const { return scene_->pairs().begun(); }
LivePairs EmulatedBroadPhase::ended() const { return scene_->pairs().ended(); }
LivePairs EmulatedBroadPhase::pairs() { return scene_->gather_pairs(); }
std::uint64_t EmulatedBroadPhase::object_count() const { return scene_->objects().count(); }
std::uint64_t EmulatedBroadPhase::id_limit() const { return scene_->objects().limit(); }
std::uint64_t EmulatedBroadPhase::pair_count() const { return scene_->pairs().count(); }
std::uint64_t EmulatedBroadPhase::slot_limit() const { return scene_->pairs().slot_limit(); }

std::uint64_t EmulatedBroadPhase::candidate_count() const {
  return scene_->pairs().candidate_count();
}
std::size_t EmulatedBroadPhase::held() const { return scene_->held(); }
std::size_t EmulatedBroadPhase::query_bytes() const { return scene_->queries().held(); }
std::size_t EmulatedBroadPhase::launches() const { return scene_->device().launches; }
std::size_t EmulatedBroadPhase::syncs() const { return scene_->device().syncs; }

}  // namespace throng::tests
