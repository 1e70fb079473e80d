// The GPU backend's interface for the API layer. No CUDA header, so that any compiler accepts it.
#pragma once

#include <cstddef>

#include <throng/cuda.hpp>
#include <throng/cuda_broad_phase.hpp>
#include <throng/cuda_mesh.hpp>
#include <throng/finder.hpp>
#include <throng/mesh.hpp>
#include <throng/options.hpp>

#include "base/output.hpp"
#include "base/update_boxes.hpp"
#include "mesh/triangle_boxes.hpp"

namespace throng::device {
struct QueryBatch;
}

namespace throng::cuda {

// All throw device::Failure. The arguments are valid, except for what only the device can check.
class Engine {
 public:
  virtual ~Engine() = default;

  // Boxes and pairs in host memory. `already_held`: bytes that count towards a memory cap.
  virtual void find(const Boxes& a, const Boxes* b, const Options&, std::size_t already_held,
                    base::Output*, const Consumer*, Result&) = 0;
  virtual bool nan_in_second_set() const noexcept = 0;

  // Boxes and pairs in device memory.
  virtual void reserve(std::size_t boxes, std::size_t pairs, Stream) = 0;
  virtual void find_on_device(const Boxes& a, const Boxes* b, const Options&, Pair* out,
                              std::size_t capacity, Stream, Result&) = 0;
  // Into its own memory, which grows.
  virtual Pairs find_growing(const Boxes& a, const Boxes* b, const Options&, Stream, Result&) = 0;
  virtual void find_async(const Boxes& a, const Boxes* b, const Options&, Pair* out,
                          std::size_t capacity, Report* report, Stream) = 0;

  virtual std::size_t held() const noexcept = 0;
};

// The same for intersections of triangles.
class MeshEngine {
 public:
  virtual ~MeshEngine() = default;

  // Meshes and pairs in host memory.
  virtual void find(const TriangleMesh& a, const TriangleMesh* b, const Options&,
                    std::size_t already_held, base::Output*, const Consumer*, MeshResult&) = 0;
  // After status bad_mesh.
  virtual const mesh::MeshDefects& defects() const noexcept = 0;
  virtual bool defects_in_second() const noexcept = 0;

  // Meshes and pairs in device memory.
  virtual void reserve(std::size_t triangles, std::size_t pairs, std::size_t converted_vertices,
                       Stream) = 0;
  virtual void find_on_device(const TriangleMesh& a, const TriangleMesh* b, const Options&,
                              Pair* out, std::size_t capacity, Stream, MeshResult&) = 0;
  virtual Pairs find_growing(const TriangleMesh& a, const TriangleMesh* b, const Options&, Stream,
                             MeshResult&) = 0;
  virtual void find_async(const TriangleMesh& a, const TriangleMesh* b, const Options&, Pair* out,
                          std::size_t capacity, MeshReport* report, Stream) = 0;

  virtual std::size_t held() const noexcept = 0;
};

// Persistent objects: see throng::cuda::BroadPhase; implemented in device/persistent_scene.hpp.
class Scene {
 public:
  virtual ~Scene() = default;

  virtual void add(const Boxes&, ObjectId* ids, Stream, Result&) = 0;
  virtual void remove(const ObjectId* ids, std::size_t count, Stream, Result&) = 0;
  virtual void move(const ObjectId* ids, const Boxes&, Stream, Result&) = 0;
  virtual void move_all(const Boxes&, Stream, Result&) = 0;
  virtual void set_filters(const ObjectId* ids, std::size_t count, const Filters&, Stream,
                           Result&) = 0;
  virtual void shift_origin(const Vec3& by, Stream, Result&) = 0;
  virtual void update(const Boxes*, Stream, Result&) = 0;
  virtual LivePairs gather_pairs(Stream) = 0;
  virtual void find_overlaps(const Boxes&, Stream, Result&) = 0;
  virtual void find_hits(const device::QueryBatch& sweeps, SweepHits, Stream, Result&) = 0;
  virtual void find_first_hits(const device::QueryBatch& sweeps, SweepHit* out, Stream,
                               Result&) = 0;
  // `other` is from create_scene(), too.
  virtual void copy(const Scene&, Stream) = 0;

  virtual LivePairs begun() const noexcept = 0;
  virtual LivePairs ended() const noexcept = 0;
  virtual LivePairs candidates() const noexcept = 0;
  virtual Pairs overlaps() const noexcept = 0;
  virtual SweepHitList hits() const noexcept = 0;
  virtual std::uint64_t object_count() const noexcept = 0;
  virtual std::uint64_t pair_count() const noexcept = 0;
  virtual std::uint64_t id_limit() const noexcept = 0;
  virtual std::uint64_t slot_limit() const noexcept = 0;
  virtual std::size_t held() const noexcept = 0;
};

// Whether this build has the backend.
bool is_built() noexcept;
// For the current device. Failure: no_device, with CUDA's message; out_of_memory.
Engine* create(const MemoryResource&);
MeshEngine* create_mesh_engine(const MemoryResource&);
Scene* create_scene(float fat_margin, const Options&, const MemoryResource&);
void check_available();

// `report` may be null.
void update_boxes_async(const base::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream);
// Synchronizes with the stream; returns *report.
BodyReport update_boxes(const base::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream);

}  // namespace throng::cuda
