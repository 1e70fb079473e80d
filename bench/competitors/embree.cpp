// Embree's rtcCollide of a scene with itself. Boxes are user geometry. The tree has low build
// quality and is rebuilt each frame, which is the fastest setting here. Every pair is reported
// twice and kept once.
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#if THRONG_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "competitors.hpp"

namespace throng::bench {
namespace {

class Embree : public Method {
 public:
  // Threads are limited during a run. A device limited by its configuration would limit TBB in the
  // whole process, and a separate arena does not bind Embree's own.
  explicit Embree(unsigned threads) : threads_(threads), out_(512), device_(rtcNewDevice(nullptr)) {
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_LOW);
    rtcAttachGeometry(scene_, geometry_);
  }
  ~Embree() override {
    rtcReleaseGeometry(geometry_);
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }

  void run(const Input& in) override {
    boxes_ = in.boxes;
    for (PairBuffer& out : out_) out.clear();
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads_);
    rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(in.count));
    rtcSetGeometryUserData(geometry_, this);
    rtcSetGeometryBoundsFunction(geometry_, bounds, this);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
    rtcCollide(scene_, scene_, collide, this);
  }
  void collect(const Input&, std::vector<Pair>& all) const override {
    for (const PairBuffer& out : out_) all.insert(all.end(), out.begin(), out.end());
  }

 private:
  static void bounds(const RTCBoundsFunctionArguments* args) {
    const Box& b = static_cast<const Embree*>(args->geometryUserPtr)->boxes_[args->primID];
    RTCBounds& o = *args->bounds_o;
    o.lower_x = b.lower.x;
    o.lower_y = b.lower.y;
    o.lower_z = b.lower.z;
    o.upper_x = b.upper.x;
    o.upper_y = b.upper.y;
    o.upper_z = b.upper.z;
  }
  static void collide(void* user, RTCCollision* hits, unsigned count) {
    Embree& self = *static_cast<Embree*>(user);
    PairBuffer& out =
        self.out_[static_cast<std::size_t>(tbb::this_task_arena::current_thread_index())];
    for (unsigned k = 0; k < count; ++k) {
      const unsigned a = hits[k].primID0, b = hits[k].primID1;
      if (a < b && overlap(self.boxes_[a], self.boxes_[b])) out.push({a, b});
    }
  }

  unsigned threads_;
  std::vector<PairBuffer> out_;  // by TBB's thread index
  RTCDevice device_;
  RTCScene scene_;
  RTCGeometry geometry_;
  const Box* boxes_ = nullptr;
};

}  // namespace

std::vector<MethodInfo> embree_methods() {
  return {{"Embree rtcCollide",
           "low build quality, rebuilt each frame; each pair is reported twice and kept once", "",
           Origin::other_library, true,
           [](unsigned threads) { return std::make_unique<Embree>(threads); }}};
}

}  // namespace throng::bench
