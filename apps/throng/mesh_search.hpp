// Runs a MeshFinder over one mesh or two, repeatedly, and collects the results.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <throng/mesh.hpp>

#include "apps/common/failure_text.hpp"
#include "apps/meshes/mesh_file.hpp"

namespace throng::cli {

// A mesh and its name for messages.
struct NamedMesh {
  std::string name;
  meshes::MeshFile mesh;
  std::size_t merged = 0;  // vertices that --weld removed
};

struct MeshSearchRequest {
  Options options;
  common::HintOptions hint_options;
  std::optional<double> within;  // a distance; nothing: intersections
  std::size_t repeat = 1;
  std::string output;  // file for the pairs; empty: none
  bool marks = false;  // whether to fill MeshSearchReport::marked_a and marked_b
};

struct MeshSearchReport {
  std::uint64_t pairs = 0, checksum = 0, candidates = 0, exact_tests = 0;
  // Pairs by IntersectionKind. `apart`: kind none; only with a distance.
  std::uint64_t crossing = 0, touching = 0, coplanar = 0, apart = 0;
  Plan plan;
  StageTimes stages;    // medians over the warmed runs
  double total_ms = 0;  // the same, measured outside: call to return
  double first_ms = 0;  // the first call, cold
  double kinds_ms = 0;  // to describe all pairs, once
  std::uint64_t marked_triangles_a = 0, marked_triangles_b = 0;  // of any pair
  std::optional<std::uint64_t> peak_bytes;
  // 1 for each triangle that is in a pair.
  std::vector<std::uint8_t> marked_a, marked_b;
};

// One cold run gives the pairs, their checksum and kinds, and writes the output; then `repeat`
// warmed runs. Throws Failure, FileError, Interrupted.
MeshSearchReport run_mesh_search(const NamedMesh& a, const NamedMesh* b,
                                 const MeshSearchRequest& request);

}  // namespace throng::cli
