// Persistent objects on a GPU: device/persistent_scene.hpp over the Device.
#include <new>

#include "cuda/argument_checks.hpp"
#include "cuda/backend.hpp"
#include "cuda/device.cuh"
#include "device/persistent_scene.hpp"

namespace throng::cuda {
namespace {

using device::Failure;

class GpuScene final : public Scene {
 public:
  GpuScene(float fat_margin, const Options& options, const MemoryResource& resource)
      : memory_(resource), scene_(fat_margin, options, memory_) {}

  void add(const Boxes& boxes, ObjectId* ids, Stream stream, Result& r) override {
    const CurrentDevice current = begin(stream);
    require_set(device::make_set(boxes), boxes.size(), ordinal());
    if (ids) require_ids(ids, boxes.size());
    scene_.add(boxes, ids, r);
  }
  void remove(const ObjectId* ids, std::size_t count, Stream stream, Result& r) override {
    const CurrentDevice current = begin(stream);
    require_ids(ids, count);
    scene_.remove(ids, count, r);
  }
  void move(const ObjectId* ids, const Boxes& boxes, Stream stream, Result& r) override {
    const CurrentDevice current = begin(stream);
    require_ids(ids, boxes.size());
    require_set(device::make_set(boxes), boxes.size(), ordinal());
    scene_.move(ids, boxes, r);
  }
  void move_all(const Boxes& boxes, Stream stream, Result& r) override {
    const CurrentDevice current = begin(stream);
    require_set(device::make_set(boxes), boxes.size(), ordinal());
    scene_.move_all(boxes, r);
  }
  void set_filters(const ObjectId* ids, std::size_t count, const Filters& filters, Stream stream,
                   Result& r) override {
    const CurrentDevice current = begin(stream);
    require_ids(ids, count);
    Boxes bare;
    bare.filters = filters;
    if (count) require_filters(device::make_set(bare), ordinal());
    scene_.set_filters(ids, count, filters, r);
  }
  void shift_origin(const Vec3& by, Stream stream, Result& r) override {
    const CurrentDevice current = begin(stream);
    scene_.shift_origin(by, r);
  }
  void update(const Boxes* boxes, Stream stream, Result& r) override {
    const CurrentDevice current = begin(stream);
    if (boxes) require_set(device::make_set(*boxes), boxes->size(), ordinal());
    scene_.update(boxes, r);
  }
  LivePairs gather_pairs(Stream stream) override {
    const CurrentDevice current = begin(stream);
    return scene_.gather_pairs();
  }
  void find_overlaps(const Boxes& boxes, Stream stream, Result& r) override {
    const CurrentDevice current = begin(stream);
    require_set(device::make_set(boxes), boxes.size(), ordinal());
    scene_.find_overlaps(boxes, r);
  }
  void find_hits(const device::QueryBatch& sweeps, SweepHits which, Stream stream,
                 Result& r) override {
    const CurrentDevice current = begin(stream);
    require_set(device::make_set(sweeps.boxes), sweeps.boxes.size(), ordinal());
    scene_.find_hits(sweeps, which, r);
  }
  void find_first_hits(const device::QueryBatch& sweeps, SweepHit* out, Stream stream,
                       Result& r) override {
    const CurrentDevice current = begin(stream);
    const std::size_t count = sweeps.boxes.size();
    if (count)
      AccessCheck(ordinal(), Status::bad_boxes)
          .require(out, alignof(SweepHit), "the array of hits");
    require_set(device::make_set(sweeps.boxes), count, ordinal());
    scene_.find_first_hits(sweeps, out, r);
  }
  void copy(const Scene& other, Stream stream) override {
    const CurrentDevice current = begin(stream);
    const auto& theirs = static_cast<const GpuScene&>(other);
    if (theirs.ordinal() != ordinal())
      throw Failure{Status::bad_option, 0, "is of another GPU than the copy", "the BroadPhase"};
    check(cudaDeviceSynchronize());  // the other's last call may still run, on another stream
    scene_.copy(theirs.scene_);
    check(cudaStreamSynchronize(stream));  // the other may be destroyed after this
  }

  LivePairs begun() const noexcept override { return scene_.pairs().begun(); }
  LivePairs ended() const noexcept override { return scene_.pairs().ended(); }
  LivePairs candidates() const noexcept override { return scene_.pairs().candidates(); }
  Pairs overlaps() const noexcept override { return scene_.queries().overlaps(); }
  SweepHitList hits() const noexcept override { return scene_.queries().hits(); }
  std::uint64_t object_count() const noexcept override { return scene_.objects().count(); }
  std::uint64_t pair_count() const noexcept override { return scene_.pairs().count(); }
  std::uint64_t id_limit() const noexcept override { return scene_.objects().limit(); }
  std::uint64_t slot_limit() const noexcept override { return scene_.pairs().slot_limit(); }
  std::size_t held() const noexcept override { return scene_.held(); }

 private:
  int ordinal() const noexcept { return scene_.device().ordinal(); }
  // Sets the stream; the device is current for the lifetime of the returned object.
  CurrentDevice begin(Stream stream) {
    if (stream && device_of(stream) != ordinal())
      throw Failure{Status::bad_option, 0, "is of another device than this BroadPhase",
                    "the stream"};
    scene_.device().begin(stream, false);
    return CurrentDevice(ordinal());
  }
  void require_ids(const ObjectId* ids, std::size_t count) const {
    if (count)
      AccessCheck(ordinal(), Status::bad_boxes).require(ids, alignof(ObjectId), "the list of ids");
  }

  Memory memory_;
  device::PersistentScene<Device> scene_;
};

}  // namespace

Scene* create_scene(float fat_margin, const Options& options, const MemoryResource& resource) {
  check_available();
  Scene* scene = new (std::nothrow) GpuScene(fat_margin, options, resource);
  if (!scene) throw Failure{Status::out_of_memory, sizeof(GpuScene)};
  return scene;
}

}  // namespace throng::cuda
