// Throng as a broad phase of FCL: give an FclManager where a DynamicAABBTreeCollisionManager would
// stand.
//
// Its pairs are those of FCL's own AABB::overlap() over the boxes that the objects had when they
// were registered or last updated; boxes of doubles are rounded outward, and FCL's comparison comes
// last. A callback gets each pair once, in an order that depends on nothing but the calls before.
// Whole objects are handed over: an octree is one, not its cells.
// Questions are const, and several threads may ask at once. Where Throng cannot do what it is asked
// for, as memory is short, it throws throng::Error.
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

  // Of the options, isa, threads, executor and memory hold.
  explicit FclManager(const Options& options = {}) : phase_(usable(options)) {}

  using Base::collide;
  using Base::distance;
  using Base::update;

  void registerObjects(const std::vector<Object*>& objects) override;
  // An object that is here is updated.
  void registerObject(Object* object) override { registerObjects({object}); }
  // An object that is not here is not looked at. So below.
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
  // `other` may be of any class. This one: the same as without.
  void collide(Base* other, void* data, fcl::CollisionCallBack<S> callback) const override;

  // Boxes are looked at in the order of their distance, or along x, for as long as they are nearer
  // than what the callback has found.
  void distance(Object* object, void* data, fcl::DistanceCallBack<S> callback) const override;
  void distance(void* data, fcl::DistanceCallBack<S> callback) const override;
  void distance(Base* other, void* data, fcl::DistanceCallBack<S> callback) const override;

  // What lies below, to look at: counts, memory, options.
  const BroadPhase& phase() const { return phase_; }

 private:
  using Bounds = fcl::AABB<S>;
  struct Near {  // an object on the way along x
    Object* object;
    const Bounds* bounds;
    bool second;  // of the other manager
  };

  static Options usable(Options options) {
    options.nan = NanPolicy::inactive;
    options.margin = 0;
    options.measure_stages = false;
    return options;
  }
  static void require(const Result& r) {
    if (!r.ok()) throw Error(r);
  }
  // A box to find candidates by. FCL's comparison lets an inverted box overlap those that contain
  // it the right way round; NaN stays, and makes the box inactive.
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
  void list(const Base* other, std::vector<Near>& out) const;
  static void sweep(std::vector<Near>& all, bool across, void* data,
                    fcl::DistanceCallBack<S> callback);

  mutable std::mutex asking_;  // guards these three
  mutable BroadPhase phase_;
  mutable bool stale_ = false;  // something has changed since the last update
  mutable LivePairs pairs_;
  std::unordered_map<Object*, ObjectId> ids_;
  std::vector<Object*> objects_;  // by id; null where there is none
  std::vector<Bounds> bounds_;    // as Throng was told
  std::vector<Box> fresh_;        // room for update()
};

}  // namespace throng

#include <throng/fcl_inl.hpp>
