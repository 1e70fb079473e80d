// Collects vertices and polygons as a parser finds them; checks indices and cuts polygons.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "apps/meshes/mesh_file.hpp"

namespace throng::meshes {

// A place in a file: a line from 1, or a byte from 0.
struct Place {
  const char* unit = "line";
  std::uint64_t number = 0;
};

class MeshBuilder {
 public:
  MeshBuilder(std::string name, Precision precision);

  // FileError: "NAME, line 7: found FOUND, wanted WANTED".
  [[noreturn]] void fail(Place place, const std::string& found, const std::string& wanted) const;
  [[noreturn]] void fail(const std::string& found, const std::string& wanted) const;

  // Throws for a finite value that is no float32, unless doubles are kept.
  void add_vertex(double x, double y, double z, Place place);

  // Starts a polygon; its corners follow.
  void begin_polygon() noexcept { corners_ = 0; }
  // `written`: the index plus this is what the file has, for messages.
  void add_corner(std::uint64_t index, Place place, unsigned written = 0);
  // Ends it. A polygon of n corners is n - 2 triangles.
  void end_polygon();

  std::size_t vertex_count() const noexcept { return mesh_.vertex_count(); }

  // Throws for an index of a corner without a vertex, and for a file without vertices.
  MeshFile finish();

 private:
  void add_triangle(Triangle triangle);

  std::string name_;
  MeshFile mesh_;
  std::uint64_t corners_ = 0;  // of the polygon so far
  std::uint32_t first_ = 0, last_ = 0;
  // The largest index and where it is.
  bool any_corner_ = false;
  std::uint32_t largest_ = 0;
  unsigned largest_written_ = 0;
  Place largest_place_;
};

}  // namespace throng::meshes
