// Contact candidates: boxes of the elements of a moving mesh, searched for overlaps, with
// neighbours left out where pairs are found.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/contact.hpp>
#include <throng/memory_resource.hpp>

#include "base/cancellation.hpp"
#include "base/memory.hpp"
#include "grid/engine.hpp"
#include "mesh/vertex_rings.hpp"

namespace throng::mesh {

// Elements of one kind with an index out of range or a vertex that is not finite.
struct InvalidElements {
  enum class Kind : std::uint8_t { edge, face };
  Kind kind = Kind::edge;
  std::uint64_t first = 0, count = 0;
};

// Whether the candidates are edge-vertex, or vertex-face and edge-edge.
inline bool is_flat(const ContactMesh& mesh) noexcept { return mesh.dimension == 2; }

class ContactSearch {
 public:
  // `already_held`: bytes that the owner took from `memory` for this object.
  ContactSearch(std::pmr::memory_resource* memory, std::size_t already_held) noexcept;
  ContactSearch(const ContactSearch&) = delete;
  ContactSearch& operator=(const ContactSearch&) = delete;

  // The API layer checks all but the indices and the values of vertices, which set `invalid` and
  // Status::bad_mesh.
  Result find(const ContactMesh& mesh, double radius, const Options& options,
              InvalidElements& invalid);

  // Those of the last call; empty if it failed.
  const ContactCandidatesView& candidates() const noexcept { return candidates_; }
  std::size_t held() const noexcept;

 private:
  struct Call;
  void run(Call& call);
  void fill_vertex_boxes(Call& call);
  template <class Element>
  bool fill_element_boxes(Call& call, const Strided<Element>& elements, base::Buffer<Box>& boxes,
                          base::Buffer<std::uint32_t>& filters, Boxes& view,
                          InvalidElements::Kind kind);
  void search(Call& call, const Boxes& a, const Boxes* b, grid::PairTest& test,
              base::Buffer<Pair>& pairs, Pairs& view);

  mutable grid::Engine engine_;  // Engine::memory() is not const
  base::Buffer<Box> vertex_boxes_, edge_boxes_, face_boxes_;
  // Of edges and faces, if the mesh has filters: the groups, then the masks, of all vertices of an
  // element combined.
  base::Buffer<std::uint32_t> edge_filters_, face_filters_;
  VertexRings rings_;
  base::Buffer<Pair> vertex_face_, edge_edge_, edge_vertex_;
  ContactCandidatesView candidates_;
};

}  // namespace throng::mesh
