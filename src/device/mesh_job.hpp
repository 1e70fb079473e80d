// A search for intersecting triangles: what it adds to the search of boxes.
//
// A Device provides, in addition to what device/engine.hpp lists,
//   mesh_bytes(mesh), copy_mesh(mesh, to)  size of a device copy of a mesh, and the copy itself
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include <throng/mesh.hpp>

#include "device/failure.hpp"
#include "device/list_search.hpp"
#include "device/mesh_stages.hpp"
#include "device/pipeline.hpp"
#include "mesh/triangle_boxes.hpp"

namespace throng::device {

// How the vertices of one or two meshes are read: all as floats, or all as doubles. `b` null: one
// mesh. Reads no arrays.
struct MeshLayout {
  bool is_float = false;
  bool moves[2] = {}, converts[2] = {};  // the vertices are copied as doubles, moved or not
  std::size_t converted_vertices = 0;

  MeshLayout(const TriangleMesh& a, const TriangleMesh* b) noexcept {
    moves[0] = !mesh::is_identity(a.transform);
    moves[1] = b && !mesh::is_identity(b->transform);
    is_float = a.vertices.is_float() && !moves[0] && (!b || (b->vertices.is_float() && !moves[1]));
    const auto converted = [&](const TriangleMesh& m, int k) {
      converts[k] = moves[k] || (!is_float && m.vertices.is_float());
      if (converts[k]) converted_vertices += m.vertices.size();
    };
    converted(a, 0);
    if (b) converted(*b, 1);
  }
};

// Device memory of a search in addition to that of the boxes, carved from one block.
struct MeshWorkspace {
  MeshState* state = nullptr;
  MeshReport* report = nullptr;
  Box* boxes = nullptr;
  Pair* uncertain = nullptr;
  std::uint64_t uncertain_capacity = 0;
  DoubleVec3* points = nullptr;

  // Sets the pointers into `base`; returns the bytes. base null: only measures.
  std::size_t carve(std::size_t triangles, std::size_t converted_vertices, char* base) noexcept {
    std::size_t at = 0;
    const auto take = [&](auto*& p, std::size_t n) {
      using T = std::remove_reference_t<decltype(*p)>;
      p = base ? reinterpret_cast<T*>(base + at) : nullptr;
      at += (n * sizeof(T) + 255) / 256 * 256;
    };
    // Most meshes leave few candidates uncertain. Of flat ones most are; then the list is full.
    uncertain_capacity = triangles / 4 + 1024;
    take(state, 1);
    take(report, 1);
    take(boxes, triangles);
    take(uncertain, uncertain_capacity);
    take(points, converted_vertices);
    return at;
  }
};

// The launches of a search of meshes in device memory.
template <class Device>
class MeshPipeline {
 public:
  MeshPipeline(Device& device, const TriangleMesh& a, const TriangleMesh* b,
               const MeshWorkspace& workspace) noexcept
      : device_(device), w_(workspace), layout_(a, b) {
    count_[0] = a.size();
    count_[1] = b ? b->size() : 0;
    given_[0] = a;
    given_[1] = b ? *b : a;
    input_.one_mesh = b == nullptr;
    input_.is_float = layout_.is_float;
    arrays_[0] = arrays_of(0, w_.points);
    arrays_[1] =
        b ? arrays_of(1, w_.points + (layout_.converts[0] ? a.vertices.size() : 0)) : arrays_[0];
    input_.a = arrays_[0];
    input_.b = arrays_[1];
  }

  // Writes the boxes of all triangles, and what is wrong with them.
  void write_boxes() const {
    device_.clear(w_.state, sizeof *w_.state);
    device_.clear(w_.report, sizeof *w_.report);
    const int meshes = input_.one_mesh ? 1 : 2;
    for (int k = 0; k < meshes; ++k) {
      if (!layout_.converts[k]) continue;
      auto* to = reinterpret_cast<DoubleVec3*>(const_cast<char*>(arrays_[k].vertices));
      device_.launch(vertices(k), ConvertVertices{as_given(k),
                                                  {given_[k].vertices.is_float()},
                                                  given_[k].transform,
                                                  layout_.moves[k],
                                                  to});
    }
    if (!layout_.is_float) device_.launch(1, ChooseOrigin{arrays_[0], vertices(0), w_.state});
    for (int k = 0; k < meshes; ++k) {
      const auto first = static_cast<std::uint32_t>(k == 0 ? 0 : count_[0]);
      device_.launch(count_[k], WriteTriangleBoxes{arrays_[k],
                                                   {layout_.is_float},
                                                   vertices(k),
                                                   k == 1,
                                                   first,
                                                   w_.state,
                                                   w_.report,
                                                   w_.boxes + first});
    }
  }
  // Of the boxes in device memory.
  Input make_input(const Options& options) const noexcept {
    return make_input(given_[0], input_.one_mesh ? nullptr : &given_[1], w_.boxes, options);
  }
  static Input make_input(const TriangleMesh& a, const TriangleMesh* b, const Box* boxes,
                          const Options& options) noexcept {
    Options of_boxes;
    of_boxes.cell_scale = options.cell_scale;
    Boxes first(boxes, a.size()), second(boxes ? boxes + a.size() : nullptr, b ? b->size() : 0);
    first.filters = a.filters;
    if (b) second.filters = b->filters;
    Input in = device::make_input(first, b ? &second : nullptr, of_boxes);
    in.grid_only = true;
    return in;
  }

  // Before, in, and after each search.
  void begin_search() const {
    device_.clear(&w_.report->candidates, 2 * sizeof w_.report->candidates);  // and exact_tests
  }
  TriangleTest check() const noexcept {
    return {input_, w_.state, w_.report, w_.uncertain, w_.uncertain_capacity};
  }
  void end_search(const PairSink& sink) const {
    device_.search(w_.uncertain_capacity, ListSearch<DecideUncertain>{{check()}}, sink);
    device_.mark(Stage::find);  // again
  }

  // Reads what is wrong with the first bad triangle. `report` has one.
  mesh::MeshDefects defects(const MeshReport& report, bool& in_second) const {
    device_.launch(1, InspectBadTriangle{{arrays_[0], arrays_[1]},
                                         {layout_.is_float},
                                         {vertices(0), vertices(1)},
                                         static_cast<std::uint32_t>(count_[0]),
                                         w_.report,
                                         w_.state});
    const MeshState state = device_.read(*w_.state);
    const std::uint32_t first = report.first_bad();
    in_second = !input_.one_mesh && first >= count_[0];
    mesh::MeshDefects defects;
    defects.count = in_second ? report.bad_in_second : report.bad_triangles - report.bad_in_second;
    defects.first = in_second ? first - count_[0] : first;
    defects.vertex = state.bad_vertex;
    defects.out_of_range = state.out_of_range != 0;
    return defects;
  }

 private:
  std::uint64_t vertices(int k) const noexcept { return given_[k].vertices.size(); }
  mesh::MeshArrays as_given(int k) const noexcept {
    const TriangleMesh& m = given_[k];
    mesh::MeshArrays arrays;
    arrays.triangles = reinterpret_cast<const char*>(m.triangles.data);
    arrays.triangle_stride_bytes = m.triangles.stride_bytes;
    arrays.vertices = static_cast<const char*>(m.vertices.data());
    arrays.vertex_stride_bytes = m.vertices.stride_bytes();
    return arrays;
  }
  mesh::MeshArrays arrays_of(int k, const DoubleVec3* points) const noexcept {
    mesh::MeshArrays arrays = as_given(k);
    if (layout_.converts[k]) {
      arrays.vertices = reinterpret_cast<const char*>(points);
      arrays.vertex_stride_bytes = sizeof(DoubleVec3);
    }
    return arrays;
  }

  Device& device_;
  MeshWorkspace w_;
  MeshLayout layout_;
  TriangleMesh given_[2];
  std::uint64_t count_[2];
  mesh::MeshArrays arrays_[2];
  mesh::PairInput input_;
};

// Meshes in host memory as a job of Engine: see BoxJob.
template <class Device>
class MeshJob {
 public:
  MeshJob(const TriangleMesh& a, const TriangleMesh* b, const Options& options,
          MeshResult& result) noexcept
      : a_(a), b_(b), options_(options), result_(result), layout_(a, b) {}

  std::uint64_t size() const noexcept { return std::uint64_t{a_.size()} + (b_ ? b_->size() : 0); }
  Input shape() const noexcept {
    return MeshPipeline<Device>::make_input(a_, b_, nullptr, options_);
  }
  std::size_t bytes() const noexcept {
    MeshWorkspace none;
    return Device::mesh_bytes(a_) + (b_ ? Device::mesh_bytes(*b_) : 0) + carve(none, nullptr);
  }
  Input prepare(Device& device, char* to) {
    const TriangleMesh first = device.copy_mesh(a_, to);
    const TriangleMesh second = b_ ? device.copy_mesh(*b_, to) : TriangleMesh();
    carve(workspace_, to);
    pipeline_.emplace(device, first, b_ ? &second : nullptr, workspace_);
    pipeline_->write_boxes();
    return pipeline_->make_input(options_);
  }
  Report* report(Report*) const noexcept { return &workspace_.report->search; }
  Report read(Device& device, const Report&) {
    const MeshReport report = device.read(*workspace_.report);
    if (!keeps_counts_) {
      result_.candidates = report.candidates;
      result_.exact_tests = report.exact_tests;
    }
    last_ = report;
    return report.search;
  }
  bool accept(Device&, const Report&, const Input&, NanPolicy, Result& r, bool&) {
    if (last_.bad_triangles == 0) return true;
    defects_ = pipeline_->defects(last_, in_second_);
    r.status = Status::bad_mesh;
    r.first_invalid = defects_.first;
    r.invalid_count = defects_.count;
    return false;
  }
  void begin_search(Device&) const { pipeline_->begin_search(); }
  TriangleTest check() const noexcept { return pipeline_->check(); }
  void end_search(Device&, const PairSink& sink) const { pipeline_->end_search(sink); }
  void keep_counts() noexcept { keeps_counts_ = true; }

  const mesh::MeshDefects& defects() const noexcept { return defects_; }
  bool defects_in_second() const noexcept { return in_second_; }

 private:
  std::size_t carve(MeshWorkspace& w, char* to) const noexcept {
    return w.carve(static_cast<std::size_t>(size()), layout_.converted_vertices, to);
  }

  const TriangleMesh& a_;
  const TriangleMesh* b_;
  const Options& options_;
  MeshResult& result_;
  MeshLayout layout_;
  MeshWorkspace workspace_;
  std::optional<MeshPipeline<Device>> pipeline_;
  MeshReport last_;
  bool keeps_counts_ = false;
  mesh::MeshDefects defects_;
  bool in_second_ = false;
};

}  // namespace throng::device
