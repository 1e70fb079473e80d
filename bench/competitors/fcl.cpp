// FCL's dynamic AABB tree. Bounds are written into its objects outside the measured time, as a
// simulation does anyway. The time is the update of the tree and the search. The tree is refitted
// (update) or rebuilt (clear and register all). Which is faster depends on how far the boxes moved.
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>

#include "competitors.hpp"

namespace throng::bench {
namespace {

class Object : public fcl::CollisionObject<float> {
 public:
  using fcl::CollisionObject<float>::CollisionObject;
  std::uint32_t number = 0;
  void set(const Box& b) {
    this->aabb.min_ = {b.lower.x, b.lower.y, b.lower.z};
    this->aabb.max_ = {b.upper.x, b.upper.y, b.upper.z};
  }
};

class Fcl : public Method {
 public:
  explicit Fcl(bool refit) : refit_(refit) {}

  void prepare(const Input& in) override {
    manager_ = std::make_unique<fcl::DynamicAABBTreeCollisionManager<float>>();
    objects_.clear();
    pointers_.clear();
    const auto shape = std::make_shared<fcl::Box<float>>(1.0f, 1.0f, 1.0f);
    for (std::size_t i = 0; i < in.count; ++i) {
      objects_.push_back(std::make_unique<Object>(shape));
      objects_.back()->number = static_cast<std::uint32_t>(i);
      pointers_.push_back(objects_.back().get());
    }
    place(in);
    manager_->registerObjects(pointers_);
    manager_->setup();
  }
  void place(const Input& in) override {
    for (std::size_t i = 0; i < in.count; ++i) objects_[i]->set(in.boxes[i]);
  }
  void run(const Input&) override {
    out_.clear();
    if (refit_) {
      manager_->update();
    } else {
      manager_->clear();
      manager_->registerObjects(pointers_);
      manager_->setup();
    }
    manager_->collide(&out_, hit);
  }
  void collect(const Input&, std::vector<Pair>& all) const override {
    all.insert(all.end(), out_.begin(), out_.end());
  }

 private:
  // FCL calls this only for objects whose bounds overlap.
  static bool hit(fcl::CollisionObject<float>* a, fcl::CollisionObject<float>* b, void* out) {
    static_cast<PairBuffer*>(out)->push(
        ordered(static_cast<Object*>(a)->number, static_cast<Object*>(b)->number));
    return false;
  }

  bool refit_;
  std::unique_ptr<fcl::DynamicAABBTreeCollisionManager<float>> manager_;
  std::vector<std::unique_ptr<Object>> objects_;
  std::vector<fcl::CollisionObject<float>*> pointers_;
  PairBuffer out_;
};

MethodInfo method(bool refit) {
  return {refit ? "FCL dynamic AABB tree, refitted" : "FCL dynamic AABB tree, rebuilt",
          "writing the bounds into its objects is not timed",
          "FCL dynamic AABB tree",
          Origin::other_library,
          false,
          [refit](unsigned) { return std::make_unique<Fcl>(refit); }};
}

}  // namespace

std::vector<MethodInfo> fcl_methods() { return {method(true), method(false)}; }

}  // namespace throng::bench
