// Persistent objects and pairs on a device: the implementation of throng::cuda::BroadPhase.
#pragma once

#include <utility>

#include "device/persistent_objects.hpp"
#include "device/persistent_pairs.hpp"
#include "device/persistent_queries.hpp"

namespace throng::device {

template <class Device>
class PersistentScene {
 public:
  // The arguments of calls are valid, except for what only the device can check.
  template <class... Args>
  PersistentScene(float fat_margin, const Options& options, Args&&... args)
      : device_(std::forward<Args>(args)...),
        options_(options),
        objects_(device_, options.margin, fat_margin),
        pairs_(device_),
        queries_(device_) {}

  Device& device() noexcept { return device_; }
  const Device& device() const noexcept { return device_; }
  const PersistentObjects<Device>& objects() const noexcept { return objects_; }
  const PersistentPairs<Device>& pairs() const noexcept { return pairs_; }
  const PersistentQueries<Device>& queries() const noexcept { return queries_; }
  std::size_t held() const noexcept {
    return device_.held() + objects_.held() + pairs_.held() + queries_.held();
  }

  void add(const Boxes& boxes, ObjectId* ids, Result& r) {
    objects_.add(boxes, ids, nan_allowed(), r);
  }
  void remove(const ObjectId* ids, std::size_t n, Result& r) { objects_.remove(ids, n, r); }
  void move(const ObjectId* ids, const Boxes& boxes, Result& r) {
    objects_.move(ids, boxes, nan_allowed(), r);
  }
  void move_all(const Boxes& boxes, Result& r) { objects_.move_all(boxes, nan_allowed(), r); }
  void set_filters(const ObjectId* ids, std::size_t n, const Filters& filters, Result& r) {
    objects_.set_filters(ids, n, filters, r);
  }
  void shift_origin(const Vec3& by, Result& r) { objects_.shift_origin(by, r); }

  // `boxes`, if not null, are those of move_all. Without events the call synchronizes once: all
  // possible steps are launched together. But if nothing moved last time, only the check is
  // launched at first, because nothing is likely to have moved now.
  void update(const Boxes* boxes, Result& r) {
    pairs_.prepare_retest();
    UpdateReport* at = objects_.report();
    const ObjectView objects = objects_.view();
    UpdateReport report{};
    const bool unknown = boxes && !(nothing_moved_last_ && !objects_.differ(*boxes, at));
    if (unknown) {
      objects_.launch_check_all(*boxes, at);
      objects_.launch_move_all(*boxes, nan_allowed(), at);
    } else if (!boxes || objects_.moved()) {
      device_.clear(&at->changed, sizeof at->changed);
    }
    const bool retest = !objects_.left() && !objects_.stale() && pairs_.candidate_count() != 0 &&
                        (unknown || objects_.moved());
    if (retest)
      pairs_.launch_retest(objects, at, unknown ? &at->checked : nullptr, nan_allowed(),
                           objects_.moved(), objects_.activity_changed());
    if (unknown || retest) report = objects_.take(at);
    if (unknown && !objects_.accept(report.checked, nan_allowed(), r)) return;
    if (boxes) nothing_moved_last_ = report.checked.moved == 0;
    if (objects_.left() || objects_.stale()) {
      const auto begin = [&] {
        objects_.set_stale();  // in case memory runs out
        r.plan.reason = "few boxes left their fat boxes: their candidates found again";
      };
      if (objects_.stale() || !pairs_.commit_escaped(objects, at, begin, r)) {
        r.plan.reason = "all candidates found again";
        pairs_.commit_all(objects_.fatten(), objects, options_, objects_.filters_changed(), at, r);
      }
    } else {
      r.plan.reason =
          objects_.moved() ? "no box left its fat box: candidates compared again" : "nothing moved";
      r.comparisons = report.changed.comparisons;
      pairs_.commit_retest(objects, report.changed, objects_.activity_changed(), at);
      if (objects_.moved()) pairs_.list_uncertain(objects);
    }
    objects_.finish_update();
    r.found = pairs_.count();
  }
  LivePairs gather_pairs() { return pairs_.pairs(); }

  void find_overlaps(const Boxes& boxes, Result& r) {
    queries_.find_overlaps(objects_, boxes, nan_allowed(), r);
  }
  void find_hits(const QueryBatch& sweeps, SweepHits which, Result& r) {
    queries_.find_hits(objects_, sweeps, which, r);
  }
  void find_first_hits(const QueryBatch& sweeps, SweepHit* out, Result& r) {
    queries_.find_first_hits(objects_, sweeps, out, r);
  }

  // Copies from a scene on the same device. On a Failure nothing changes.
  void copy(const PersistentScene& other) {
    objects_.reserve_for(other.objects_);
    pairs_.reserve_for(other.pairs_);
    objects_.copy(other.objects_);
    pairs_.copy(other.pairs_);
    options_.margin = other.options_.margin;
  }

 private:
  bool nan_allowed() const noexcept { return options_.nan == NanPolicy::inactive; }

  Device device_;
  Options options_;
  PersistentObjects<Device> objects_;
  PersistentPairs<Device> pairs_;
  PersistentQueries<Device> queries_;
  bool nothing_moved_last_ = false;  // nothing had moved in the last update with boxes
};

}  // namespace throng::device
