// The vertices within some edges of each vertex.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/contact.hpp>

#include "base/cancellation.hpp"
#include "base/memory.hpp"
#include "base/per_thread.hpp"

namespace throng::mesh {

// For each vertex a sorted list of the vertices that at most `rings` edges join to it, itself
// among them. Keeps the lists while the mesh's edges and faces stay the same.
class VertexRings {
 public:
  explicit VertexRings(base::Memory& memory) noexcept
      : edges_(memory),
        faces_(memory),
        neighbor_begin_(memory),
        neighbors_(memory),
        begin_(memory),
        members_(memory),
        scratch_(memory) {}

  // All indices are in range; rings > 0. Faces count only if `use_faces`. False if stopped; the
  // lists are then built again by the next call. Throws AllocationFailed.
  bool build(const ContactMesh& mesh, bool use_faces, const Executor& executor, unsigned tasks,
             base::Cancellation& stop);

  const std::uint32_t* begin(std::uint32_t vertex) const noexcept {
    return members_.data() + begin_[vertex];
  }
  const std::uint32_t* end(std::uint32_t vertex) const noexcept {
    return members_.data() + begin_[vertex + std::size_t{1}];
  }
  void prefetch(std::uint32_t vertex) const noexcept;

 private:
  // One task's list in the making.
  struct Scratch {
    explicit Scratch(base::Memory& memory) noexcept : list(memory), outer(memory), found(memory) {}
    void match(const Scratch& other) {
      list.match(other.list);
      outer.match(other.outer);
      found.match(other.found);
    }
    base::Buffer<std::uint32_t> list;   // sorted
    base::Buffer<std::uint32_t> outer;  // its members in the last ring
    base::Buffer<std::uint32_t> found;
    std::size_t count = 0, outer_count = 0;
  };
  bool is_current(const ContactMesh& mesh, std::size_t face_count) const noexcept;
  void remember(const ContactMesh& mesh, std::size_t face_count);
  void collect_neighbors();
  bool grow(Scratch& scratch) const;
  // Calls put(vertex, list, count) for all vertices, from any thread. False if stopped.
  template <class Put>
  bool for_each_list(const Executor& executor, unsigned tasks, base::Cancellation& stop,
                     const Put& put);

  bool built_ = false;
  unsigned rings_ = 0;
  std::size_t vertex_count_ = 0, edge_count_ = 0, face_count_ = 0;
  // The mesh whose lists these are.
  base::Buffer<Edge> edges_;
  base::Buffer<Triangle> faces_;
  // The vertices that one edge joins to vertex v: neighbors_ from neighbor_begin_[v] to
  // neighbor_begin_[v + 1].
  base::Buffer<std::size_t> neighbor_begin_;
  base::Buffer<std::uint32_t> neighbors_;
  // The list of v: members_ from begin_[v] to begin_[v + 1].
  base::Buffer<std::size_t> begin_;
  base::Buffer<std::uint32_t> members_;
  base::PerThread<Scratch> scratch_;
};

}  // namespace throng::mesh
