// Vertices, triangles, edges and pairs in the caller's arrays, without a copy where their layout is
// the library's.
#pragma once

#include <string>

#include <nanobind/nanobind.h>

#include <throng/contact.hpp>
#include <throng/mesh.hpp>

#include "python/arrays.hpp"

namespace throng::python {

// Points as given: float32 or float64 of shape (n, 3), or (n, 2) where that is allowed.
struct PointArray {
  Vertices view;
  unsigned dimensions = 3;
};
// In place if the values of a row are contiguous, else a copy; the copy of 2-D points has z = 0.
PointArray import_points(nb::handle value, const std::string& name, bool allows_2d,
                         KeepAlive& kept);

// Rows of indices of any integer type, each 0 to 2^32 - 1: in place if they are 32-bit and the
// values of a row are contiguous, else a copy. Row is Triangle, Edge or Pair.
template <class Row>
Strided<Row> import_index_rows(nb::handle value, const std::string& name, KeepAlive& kept);

// A triangle mesh as given, and the objects that keep its view valid.
class MeshArrays {
 public:
  // `mesh`: (vertices, faces, transform), the last one 12 numbers by rows or None. `filters`:
  // (group, mask, owner, world, static), one value per triangle, or None. `prefix` precedes the
  // names in messages.
  MeshArrays(const nb::tuple& mesh, const nb::tuple& filters, const std::string& prefix);

  const TriangleMesh& view() const noexcept { return view_; }

 private:
  TriangleMesh view_;
  KeepAlive kept_;
};

}  // namespace throng::python
