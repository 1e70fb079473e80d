// Other libraries that answer queries one by one. Bullet's btDbvt also keeps the pairs. Embree does
// not: its tree of boxes is rebuilt on all threads, in low quality, when some boxes have moved.
#include <algorithm>
#include <cmath>

#include "queries.hpp"

#if defined(THRONG_BULLET)
#include "bullet_tree.hpp"
#endif
#if defined(THRONG_EMBREE)
#if THRONG_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#endif

namespace throng::bench {

#if defined(THRONG_BULLET)
namespace {

// The tree holds enlarged boxes: the box of the proxy decides.
struct RayCallback : btBroadphaseRayCallback {
  explicit RayCallback(const Sweep& ray, bool first_alone)
      : only_first(first_alone), from(to_bullet(ray.box.lower)) {
    btVector3 along = to_bullet(ray.by);
    m_lambda_max = along.length();
    along /= m_lambda_max;
    for (int k = 0; k < 3; ++k) {
      m_rayDirectionInverse[k] = along[k] == 0 ? btScalar(BT_LARGE_FLOAT) : 1 / along[k];
      m_signs[k] = m_rayDirectionInverse[k] < 0;
    }
  }
  bool process(const btBroadphaseProxy* proxy) override {
    const btVector3 corners[2] = {proxy->m_aabbMin, proxy->m_aabbMax};
    btScalar at = 0;
    if (!btRayAabb2(from, m_rayDirectionInverse, m_signs, corners, at, 0, m_lambda_max))
      return true;
    if (only_first) {
      m_lambda_max = std::max(at, btScalar(0));
      found = 1;
    } else {
      ++found;
    }
    return true;
  }
  bool only_first;
  btVector3 from;
  std::uint64_t found = 0;
};
struct RegionCallback : btBroadphaseAabbCallback {
  explicit RegionCallback(const Box& region)
      : lower(to_bullet(region.lower)), upper(to_bullet(region.upper)) {}
  bool process(const btBroadphaseProxy* proxy) override {
    found += TestAabbAgainstAabb2(lower, upper, proxy->m_aabbMin, proxy->m_aabbMax);
    return true;
  }
  btVector3 lower, upper;
  std::uint64_t found = 0;
};

class DbvtQueries : public QueryMethod {
 public:
  std::string name() const override { return "Bullet btDbvt"; }
  bool supports(QueryBatch::Kind) const override { return true; }
  void start(const std::vector<Box>& boxes) override { tree_.start(boxes); }
  void update(const Moves& moves) override { tree_.update(moves); }
  std::uint64_t run(const QueryBatch& batch) override {
    std::uint64_t found = 0;
    for (const Sweep& ray : batch.rays) {
      RayCallback callback(ray, batch.kind == QueryBatch::first_hit);
      tree_->rayTest(callback.from, callback.from + to_bullet(ray.by), callback);
      found += callback.found;
    }
    for (const Box& region : batch.regions) {
      RegionCallback callback(region);
      tree_->aabbTest(callback.lower, callback.upper, callback);
      found += callback.found;
    }
    return found;
  }

 private:
  BulletTree tree_{true};  // deferred: the faster setting
};

}  // namespace
#endif

#if defined(THRONG_EMBREE)
namespace {

class EmbreeQueries : public QueryMethod {
 public:
  EmbreeQueries() : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_LOW);
    rtcSetGeometryUserData(geometry_, this);
    rtcSetGeometryBoundsFunction(geometry_, bounds, this);
    rtcSetGeometryIntersectFunction(geometry_, intersect);
    rtcAttachGeometry(scene_, geometry_);
  }
  ~EmbreeQueries() override {
    rtcReleaseGeometry(geometry_);
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  std::string name() const override { return "Embree, rebuilt"; }
  bool supports(QueryBatch::Kind kind) const override { return kind != QueryBatch::overlaps; }
  void start(const std::vector<Box>& boxes) override {
    boxes_ = boxes;
    rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(boxes_.size()));
    commit();
  }
  void update(const Moves& moves) override {
    for (std::size_t i = 0; i < moves.ids.size(); ++i) boxes_[moves.ids[i]] = moves.boxes[i];
    commit();
  }
  std::uint64_t run(const QueryBatch& batch) override {
    only_first_ = batch.kind == QueryBatch::first_hit;
    found_ = 0;
    for (const Sweep& s : batch.rays) {
      RTCRayHit r{};
      r.ray.org_x = s.box.lower.x, r.ray.org_y = s.box.lower.y, r.ray.org_z = s.box.lower.z;
      r.ray.dir_x = s.by.x, r.ray.dir_y = s.by.y, r.ray.dir_z = s.by.z;
      r.ray.tfar = 1;
      r.ray.mask = ~0u;
      r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if THRONG_EMBREE == 4
      rtcIntersect1(scene_, &r, nullptr);
#else
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      rtcIntersect1(scene_, &context, &r);
#endif
      found_ += r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    return found_;
  }

 private:
  void commit() {
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
  }
  static void bounds(const RTCBoundsFunctionArguments* args) {
    const Box& b = static_cast<const EmbreeQueries*>(args->geometryUserPtr)->boxes_[args->primID];
    *args->bounds_o = {b.lower.x, b.lower.y, b.lower.z, 0, b.upper.x, b.upper.y, b.upper.z, 0};
  }
  static void intersect(const RTCIntersectFunctionNArguments* args) {
    if (!args->valid[0]) return;
    auto& self = *static_cast<EmbreeQueries*>(args->geometryUserPtr);
    auto& r = *reinterpret_cast<RTCRayHit*>(args->rayhit);  // one ray per call
    const Box& b = self.boxes_[args->primID];
    float enter = r.ray.tnear, leave = r.ray.tfar;
    const auto axis = [&](float lower, float upper, float from, float by) {
      const float inverse = 1 / by, x = (lower - from) * inverse, y = (upper - from) * inverse;
      enter = std::max(enter, std::min(x, y));
      leave = std::min(leave, std::max(x, y));
    };
    axis(b.lower.x, b.upper.x, r.ray.org_x, r.ray.dir_x);
    axis(b.lower.y, b.upper.y, r.ray.org_y, r.ray.dir_y);
    axis(b.lower.z, b.upper.z, r.ray.org_z, r.ray.dir_z);
    if (enter > leave) return;
    if (!self.only_first_) {
      ++self.found_;
      return;
    }
    r.ray.tfar = enter;
    r.hit.primID = args->primID;
    r.hit.geomID = args->geomID;
  }

  RTCDevice device_;
  RTCScene scene_;
  RTCGeometry geometry_;
  std::vector<Box> boxes_;
  bool only_first_ = false;
  std::uint64_t found_ = 0;
};

}  // namespace
#endif

std::vector<std::unique_ptr<QueryMethod>> query_competitors() {
  std::vector<std::unique_ptr<QueryMethod>> all;
#if defined(THRONG_BULLET)
  all.push_back(std::make_unique<DbvtQueries>());
#endif
#if defined(THRONG_EMBREE)
  all.push_back(std::make_unique<EmbreeQueries>());
#endif
  return all;
}

}  // namespace throng::bench
