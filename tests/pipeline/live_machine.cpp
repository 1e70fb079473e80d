#include "pipeline/live_machine.hpp"

#include "pipeline/far_device.hpp"
#include "pipeline/live_scene.hpp"

namespace throng::tests {

struct LiveMachine::Scene : pipeline::LiveScene<pipeline::FarDevice> {
  using LiveScene::LiveScene;
};

LiveMachine::LiveMachine(const Options& options, float fat_margin,
                         std::pmr::memory_resource* memory)
    : scene_(std::make_unique<Scene>(fat_margin, options, memory)) {}
LiveMachine::~LiveMachine() = default;

template <class F>
Result LiveMachine::call(const F& f) {
  Result r;
  try {
    f(r);
  } catch (const pipeline::Failure& failure) {
    r.status = failure.status;
    r.bytes_needed = failure.bytes;
  }
  return r;
}

Result LiveMachine::add(const Boxes& boxes, ObjectId* ids) {
  return call([&](Result& r) { scene_->add(boxes, ids, r); });
}
Result LiveMachine::remove(const ObjectId* ids, std::size_t count) {
  return call([&](Result& r) { scene_->remove(ids, count, r); });
}
Result LiveMachine::move(const ObjectId* ids, const Boxes& boxes) {
  return call([&](Result& r) { scene_->move(ids, boxes, r); });
}
Result LiveMachine::move_all(const Boxes& boxes) {
  if (!at_once_) return call([&](Result& r) { scene_->move_all(boxes, r); });
  all_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) all_.push_back(boxes[i]);
  given_ = true;
  Result r;
  r.found = object_count();
  return r;
}
Result LiveMachine::set_filters(const ObjectId* ids, std::size_t count, const Filters& filters) {
  return call([&](Result& r) { scene_->set_filters(ids, count, filters, r); });
}
Result LiveMachine::shift_origin(const Vec3& by) {
  return call([&](Result& r) { scene_->shift_origin(by, r); });
}
Result LiveMachine::update() {
  const Boxes boxes(all_.data(), all_.size());
  const Result r = call([&](Result& told) { scene_->update(given_ ? &boxes : nullptr, told); });
  given_ = given_ && r.status == Status::out_of_memory;  // again, with the same boxes
  reason_ = r.plan.reason;
  return r;
}
Result LiveMachine::copy_from(const LiveMachine& other) {
  return call([&](Result&) { scene_->copy(*other.scene_); });
}
Result LiveMachine::find_overlaps(const Boxes& boxes) {
  return call([&](Result& r) { scene_->find_overlaps(boxes, r); });
}
Result LiveMachine::find_hits(const Sweep* sweeps, std::size_t count, SweepHits which,
                              const Filters& filters, const SweepTest&) {
  return call([&](Result& r) {
    scene_->find_hits(pipeline::Asked::about(sweeps, count, filters), which, r);
  });
}
Result LiveMachine::find_first_hits(const Sweep* sweeps, std::size_t count, const Filters& filters,
                                    SweepHit* out) {
  return call([&](Result& r) {
    scene_->find_first_hits(pipeline::Asked::about(sweeps, count, filters), out, r);
  });
}
Pairs LiveMachine::overlaps() const { return scene_->questions().overlaps(); }
SweepHitList LiveMachine::hits() const { return scene_->questions().hits(); }

LivePairs LiveMachine::begun() const { return scene_->pairs().begun(); }
LivePairs LiveMachine::ended() const { return scene_->pairs().ended(); }
LivePairs LiveMachine::pairs() { return scene_->gather_pairs(); }
std::uint64_t LiveMachine::object_count() const { return scene_->objects().count(); }
std::uint64_t LiveMachine::id_limit() const { return scene_->objects().limit(); }
std::uint64_t LiveMachine::pair_count() const { return scene_->pairs().count(); }
std::uint64_t LiveMachine::slot_limit() const { return scene_->pairs().slot_limit(); }

std::uint64_t LiveMachine::candidate_count() const { return scene_->pairs().candidate_count(); }
std::size_t LiveMachine::held() const { return scene_->held(); }
std::size_t LiveMachine::questions_held() const { return scene_->questions().held(); }
std::size_t LiveMachine::puts() const { return scene_->device().puts; }
std::size_t LiveMachine::waits() const { return scene_->device().waits; }

}  // namespace throng::tests
