// Throng as a broad phase of FCL: an FclManager replaces a DynamicAABBTreeCollisionManager.
//
// Its pairs are those of FCL's own AABB::overlap() over the boxes that the objects had when they
// were registered or last updated; boxes of doubles are rounded outward, and FCL's comparison
// decides. A callback gets each pair once, in an order that depends only on the preceding calls.
// Objects are passed on whole: an octree is one object, not its cells. Queries are const and
// thread-safe. On failure, such as lack of memory, it throws throng::Error.
#pragma once

#include <throng/cpp17.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include <throng/broad_phase.hpp>
#include <throng/find_pairs.hpp>

namespace throng {

template <class S>
class FclManager : public fcl::BroadPhaseCollisionManager<S> {
 public:
  using Object = fcl::CollisionObject<S>;
  using Base = fcl::BroadPhaseCollisionManager<S>;

  // Of the options, isa, threads, executor and memory are used.
  explicit FclManager(const Options& options = {}) : phase_(supported_options(options)) {}

  using Base::collide;
  using Base::distance;
  using Base::update;

  void registerObjects(const std::vector<Object*>& objects) override;
  // A registered object is updated.
  void registerObject(Object* object) override { registerObjects({object}); }
  // Unregistered objects are ignored, here and below.
  void unregisterObject(Object* object) override;
  void setup() override { find_pairs(); }

  void update() override;
  void update(Object* object) override { update(std::vector<Object*>{object}); }
  void update(const std::vector<Object*>& objects) override;
  void clear() override;

  void getObjects(std::vector<Object*>& out) const override;
  bool empty() const override { return ids_.empty(); }
  std::size_t size() const override { return ids_.size(); }

  void collide(Object* object, void* data, fcl::CollisionCallBack<S> callback) const override;
  void collide(void* data, fcl::CollisionCallBack<S> callback) const override;
  // `other` may be of any class. If it is this object, as without it.
  void collide(Base* other, void* data, fcl::CollisionCallBack<S> callback) const override;

  // Visits boxes in order of their distance, or along x, while they are nearer than the callback's
  // result.
  void distance(Object* object, void* data, fcl::DistanceCallBack<S> callback) const override;
  void distance(void* data, fcl::DistanceCallBack<S> callback) const override;
  void distance(Base* other, void* data, fcl::DistanceCallBack<S> callback) const override;

  // The underlying BroadPhase, to inspect: counts, memory, options.
  const BroadPhase& phase() const { return phase_; }

 private:
  using Bounds = fcl::AABB<S>;
  struct SortedObject {  // an object in the order along x
    Object* object;
    const Bounds* bounds;
    bool second;  // in the other manager
  };

  static Options supported_options(Options options) {
    options.nan = NanPolicy::inactive;
    options.margin = 0;
    options.measure_stages = false;
    return options;
  }
  static void require(const Result& r) {
    if (!r.ok()) throw Error(r);
  }
  // A box that finds all candidates. By FCL's comparison an inverted box overlaps the boxes that
  // contain its reordered form; a NaN stays, and makes the box inactive.
  static Box candidate(const Bounds& bounds) {
    double lower[3], upper[3];
    for (int k = 0; k < 3; ++k) {
      lower[k] = static_cast<double>(bounds.min_[k]);
      upper[k] = static_cast<double>(bounds.max_[k]);
      if (lower[k] > upper[k]) std::swap(lower[k], upper[k]);
    }
    return round_outward(lower, upper);
  }

  LivePairs find_pairs() const;
  void find_touched(const std::vector<Box>& boxes, std::vector<Pair>& out) const;
  void list(const Base* other, std::vector<SortedObject>& out) const;
  static void sweep(std::vector<SortedObject>& all, bool across, void* data,
                    fcl::DistanceCallBack<S> callback);

  mutable std::mutex query_mutex_;  // guards these three
  mutable BroadPhase phase_;
  mutable bool stale_ = false;  // something has changed since the last update
  mutable LivePairs pairs_;
  std::unordered_map<Object*, ObjectId> ids_;
  std::vector<Object*> objects_;   // by id; null for free ids
  std::vector<Bounds> bounds_;     // as passed to Throng
  std::vector<Box> update_boxes_;  // buffers for update()
};

}  // namespace throng

#include <throng/fcl_inl.hpp>
