// The scene of a device, run by threads of the host, with the calls of a throng::BroadPhase.
#pragma once

#include <memory>
#include <memory_resource>
#include <vector>

#include "pipeline/far_device.hpp"
#include "pipeline/live_scene.hpp"
#include "support/counting.hpp"

namespace throng::tests {

class LiveMachine {
 public:
  using Scene = pipeline::LiveScene<pipeline::FarDevice>;

  explicit LiveMachine(const Options& options, float fat_margin = 0,
                       std::pmr::memory_resource* memory = std::pmr::new_delete_resource())
      : scene_(std::make_unique<Scene>(fat_margin, options, memory)) {}

  Scene& scene() { return *scene_; }

  Result add(const Boxes& boxes, ObjectId* ids) {
    return call([&](Result& r) { scene_->add(boxes, ids, r); });
  }
  Result remove(const ObjectId* ids, std::size_t count) {
    return call([&](Result& r) { scene_->remove(ids, count, r); });
  }
  Result move(const ObjectId* ids, const Boxes& boxes) {
    return call([&](Result& r) { scene_->move(ids, boxes, r); });
  }
  // A call of its own, or together with the next update.
  Result move_all(const Boxes& boxes) {
    if (!at_once_) return call([&](Result& r) { scene_->move_all(boxes, r); });
    all_.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) all_.push_back(boxes[i]);
    given_ = true;
    return {};
  }
  Result set_filters(const ObjectId* ids, std::size_t count, const Filters& filters) {
    return call([&](Result& r) { scene_->set_filters(ids, count, filters, r); });
  }
  Result shift_origin(const Vec3& by) {
    return call([&](Result& r) { scene_->shift_origin(by, r); });
  }
  Result update() {
    const Boxes boxes(all_.data(), all_.size());
    const Result r = call([&](Result& told) { scene_->update(given_ ? &boxes : nullptr, told); });
    given_ = given_ && r.status == Status::out_of_memory;  // again, with the same boxes
    reason_ = r.plan.reason;
    return r;
  }
  Result copy_from(const LiveMachine& other) {
    return call([&](Result&) { scene_->copy(*other.scene_); });
  }
  // A test is no device's to call.
  Result find_overlaps(const Boxes& boxes) {
    return call([&](Result& r) { scene_->find_overlaps(boxes, r); });
  }
  Result find_hits(const Sweep* sweeps, std::size_t count, SweepHits which, const Filters& filters,
                   const SweepTest& = {}) {
    return call([&](Result& r) {
      scene_->find_hits(pipeline::Asked::about(sweeps, count, filters), which, r);
    });
  }
  Result find_first_hits(const Sweep* sweeps, std::size_t count, const Filters& filters,
                         SweepHit* out) {
    return call([&](Result& r) {
      scene_->find_first_hits(pipeline::Asked::about(sweeps, count, filters), out, r);
    });
  }
  Pairs overlaps() const { return scene_->questions().overlaps(); }
  SweepHitList hits() const { return scene_->questions().hits(); }
  const char* last_reason() const { return reason_; }
  void move_at_once(bool at_once) { at_once_ = at_once; }

  LivePairs begun() const { return scene_->pairs().begun(); }
  LivePairs ended() const { return scene_->pairs().ended(); }
  LivePairs pairs() { return scene_->gather_pairs(); }
  std::uint64_t object_count() const { return scene_->objects().count(); }
  std::uint64_t id_limit() const { return scene_->objects().limit(); }
  std::uint64_t pair_count() const { return scene_->pairs().count(); }
  std::uint64_t slot_limit() const { return scene_->pairs().slot_limit(); }

 private:
  template <class F>
  static Result call(const F& f) {
    Result r;
    try {
      f(r);
    } catch (const pipeline::Failure& failure) {
      r.status = failure.status;
      r.bytes_needed = failure.bytes;
    }
    return r;
  }
  std::unique_ptr<Scene> scene_;
  std::vector<Box> all_;
  bool at_once_ = false, given_ = false;
  const char* reason_ = "";
};

}  // namespace throng::tests
