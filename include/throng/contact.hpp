// Candidates for contact and for continuous collision detection (CCD): pairs of a vertex and a
// face, of two edges, or of an edge and a vertex whose swept boxes overlap.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/finder.hpp>
#include <throng/mesh.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

// Indices of the two vertices of an edge.
struct Edge {
  std::uint32_t a, b;
};

// A non-owning view of a moving mesh. Each vertex moves from start[i] to end[i] along a line.
// Strides are multiples of the size of one coordinate or index.
struct ContactMesh {
  // All vertices are elements. A vertex of no edge and no face may have any value; one that is not
  // finite takes no part and is counted in Result::inactive.
  Vertices start;
  Vertices end;  // the same number as `start`; empty: nothing moves
  Strided<Edge> edges;
  Strided<Triangle> faces;
  // 3: vertex-face and edge-edge candidates. 2: edge-vertex candidates; z of the vertices and faces
  // are not used.
  int dimension = 3;
  // Elements that share a vertex are no candidates. With n rings, neither are elements of which two
  // vertices are joined by at most n edges (of `edges`, and of `faces`).
  unsigned rings = 0;
  // One value per vertex, each optional: two vertices a, b may collide if (group a & mask b) and
  // (group b & mask a) are nonzero; if only one of the two is given, the other counts as all ones.
  // Two elements are candidates if any two of their vertices may collide.
  Strided<std::uint32_t> group, mask;
};

// The candidates: exactly the pairs of elements whose boxes overlap. The box of an element contains
// its vertices at start and end, enlarged by `radius` on every side, rounded outward to floats: on
// each axis, from the largest float <= least coordinate - radius to the smallest float >= largest
// coordinate + radius, of the exact difference and sum. Boxes that touch overlap.
struct ContactCandidates {
  std::vector<Pair> vertex_face;  // vertex, face
  std::vector<Pair> edge_edge;    // first < second
  std::vector<Pair> edge_vertex;  // edge, vertex
};

// The same as views of a finder's memory.
struct ContactCandidatesView {
  Pairs vertex_face, edge_edge, edge_vertex;
};

// Keeps its memory from call to call, and with rings the lists of neighbors while edges and faces
// stay the same; see Finder for thread safety and options. Searches on the CPU. Of Options,
// `margin` must be 0, and `nan`, `inverted`, `memory_cap_bytes`, `concurrent_consumer` and
// `capture` are not used.
//
// Errors: Status::bad_mesh for a missing array, a wrong length, stride or dimension, an index out
// of range, or a vertex of an element that is not finite. Result::first_invalid is then the index
// of an edge, or of a face if all edges are valid; invalid_count counts elements of this kind.
class THRONG_API ContactFinder {
 public:
  ContactFinder() noexcept = default;
  explicit ContactFinder(const Options& options) noexcept : options_(options) {}
  ~ContactFinder();
  ContactFinder(ContactFinder&& other) noexcept;
  ContactFinder& operator=(ContactFinder&& other) noexcept;
  ContactFinder(const ContactFinder&) = delete;
  ContactFinder& operator=(const ContactFinder&) = delete;

  // `radius`: half of the distance at which two elements become candidates, >= 0.
  // Result::found is the number of candidates of all kinds.
  // Cost: O(n + candidates).
  Result find(const ContactMesh& mesh, double radius) noexcept;
  // Those of the last call.
  ContactCandidatesView candidates() const noexcept { return candidates_; }

  const Options& options() const noexcept { return options_; }
  void set_options(const Options& options) noexcept { options_ = options; }
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  State* state_ = nullptr;
  Options options_;
  ContactCandidatesView candidates_;
};

// The candidates in one call. Throws Error.
THRONG_API ContactCandidates find_contact_candidates(const ContactMesh& mesh, double radius,
                                                     const Options& options = {});

}  // namespace throng
