// Triangle meshes: which triangles intersect, exactly; which are within a distance.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/finder.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

// Indices of the three vertices of a triangle.
struct Triangle {
  std::uint32_t a, b, c;
};

// A non-owning view of points, Vec3 or DoubleVec3, `stride_bytes` apart: a multiple of the size of
// one coordinate; 0 repeats one point.
class Vertices {
 public:
  Vertices() noexcept = default;
  Vertices(const Vec3* points, std::size_t count, std::size_t stride_bytes = sizeof(Vec3)) noexcept
      : data_(points), count_(count), stride_bytes_(stride_bytes), is_float_(true) {}
  Vertices(const DoubleVec3* points, std::size_t count,
           std::size_t stride_bytes = sizeof(DoubleVec3)) noexcept
      : data_(points), count_(count), stride_bytes_(stride_bytes), is_float_(false) {}
  // Any container of Vec3 or DoubleVec3 with data() and size().
  template <class Container, class Points = decltype(std::declval<const Container&>().data()),
            class = decltype(Vertices(std::declval<Points>(), std::size_t{}))>
  Vertices(const Container& points) noexcept  // NOLINT(google-explicit-constructor): a view
      : Vertices(points.data(), points.size(), sizeof(*points.data())) {}

  std::size_t size() const noexcept { return count_; }
  bool is_float() const noexcept { return is_float_; }
  const void* data() const noexcept { return data_; }
  std::size_t stride_bytes() const noexcept { return stride_bytes_; }
  // Floats are widened, without rounding.
  DoubleVec3 operator[](std::size_t i) const noexcept {
    const char* const at = static_cast<const char*>(data_) + i * stride_bytes_;
    if (!is_float_) return *reinterpret_cast<const DoubleVec3*>(at);
    const Vec3& p = *reinterpret_cast<const Vec3*>(at);
    return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
  }

 private:
  const void* data_ = nullptr;
  std::size_t count_ = 0;
  std::size_t stride_bytes_ = 0;
  bool is_float_ = true;
};

// The affine map of a point p to (row[0] . (p, 1), row[1] . (p, 1), row[2] . (p, 1)).
struct AffineTransform {
  double row[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
};

// A non-owning view of a mesh: the arrays must outlive it. Triangles are closed sets of points.
// Vertices that no triangle uses may have any value. Triangles without area are the segments or
// points that they are.
class TriangleMesh {
 public:
  TriangleMesh() noexcept = default;
  // `triangle_stride_bytes`: a multiple of 4.
  TriangleMesh(const Vertices& points, const Triangle* first_triangle, std::size_t triangle_count,
               std::size_t triangle_stride_bytes = sizeof(Triangle)) noexcept
      : vertices(points), triangles{first_triangle, triangle_count, triangle_stride_bytes} {}
  // Any container of Triangle with data() and size().
  template <class Container,
            class = std::enable_if_t<std::is_same<
                decltype(std::declval<const Container&>().data() + 0), const Triangle*>::value>>
  TriangleMesh(const Vertices& points, const Container& corners) noexcept
      : TriangleMesh(points, corners.data(), corners.size()) {}

  std::size_t size() const noexcept { return triangles.count; }

  Vertices vertices;
  Strided<Triangle> triangles;
  // Applied to the vertices once, before the search, in doubles: each coordinate is
  // ((m0 * x + m1 * y) + m2 * z) + m3 with every operation rounded to nearest. The result is exact
  // for the rounded vertices. The identity changes nothing and costs nothing.
  AffineTransform transform;
  // One value per triangle.
  Filters filters;
};

// Adds to the Result of a search of boxes. Result::first_invalid is the index of a triangle.
struct [[nodiscard]] MeshResult : Result {
  std::uint64_t candidates = 0;   // pairs of triangles whose boxes overlap, each tested once
  std::uint64_t exact_tests = 0;  // candidates that floating-point arithmetic could not decide
};

// Finds pairs of triangles and keeps its memory from call to call. Thread safety, forms and options
// are those of Finder. Of Options, `margin`, `nan`, `inverted` and `capture` are not used.
//
// In one mesh, two triangles form a pair if they have a common point outside of the convex hull of
// the vertices that they share by index: without a shared vertex, any common point; with one, more
// than this vertex; with two, more than this edge; with three, always. In two meshes, any common
// point. The result is that of exact arithmetic on the given coordinates.
//
// Errors: Status::bad_mesh for a missing array, an invalid stride, an index out of range, or a NaN
// or an infinity in a vertex that a triangle uses.
class THRONG_API MeshFinder {
 public:
  MeshFinder() noexcept = default;
  explicit MeshFinder(const Options& options) noexcept : options_(options) {}
  ~MeshFinder();
  MeshFinder(MeshFinder&& other) noexcept;
  MeshFinder& operator=(MeshFinder&& other) noexcept;
  MeshFinder(const MeshFinder&) = delete;
  MeshFinder& operator=(const MeshFinder&) = delete;

  // Intersections of the triangles of one mesh, or of a triangle of `a` and one of `b`. Stores the
  // pairs in the finder's own growing buffer; see pairs().
  // Cost: O(n + candidates).
  MeshResult find(const TriangleMesh& mesh) noexcept;
  MeshResult find(const TriangleMesh& a, const TriangleMesh& b) noexcept;
  // The same into out[0 .. capacity-1]; see Finder::find.
  MeshResult find(const TriangleMesh& mesh, Pair* out, std::size_t capacity) noexcept;
  MeshResult find(const TriangleMesh& a, const TriangleMesh& b, Pair* out,
                  std::size_t capacity) noexcept;
  // The same to a consumer; see Finder::consume.
  MeshResult consume(const TriangleMesh& mesh, Consumer consumer);
  MeshResult consume(const TriangleMesh& a, const TriangleMesh& b, Consumer consumer);

  // Pairs of triangles at most `distance` apart, in the units of the vertices, >= 0. In one mesh
  // only triangles without a shared vertex. Every pair within the distance is found; a pair that is
  // farther apart by less than one part in 10^12 may be found.
  MeshResult find_within(const TriangleMesh& mesh, double distance) noexcept;
  MeshResult find_within(const TriangleMesh& a, const TriangleMesh& b, double distance) noexcept;
  MeshResult find_within(const TriangleMesh& mesh, double distance, Pair* out,
                         std::size_t capacity) noexcept;
  MeshResult find_within(const TriangleMesh& a, const TriangleMesh& b, double distance, Pair* out,
                         std::size_t capacity) noexcept;
  MeshResult consume_within(const TriangleMesh& mesh, double distance, Consumer consumer);
  MeshResult consume_within(const TriangleMesh& a, const TriangleMesh& b, double distance,
                            Consumer consumer);

  // The pairs of the last call, if it stored them here; else none.
  Pairs pairs() const noexcept { return pairs_; }

  // Options may change between calls, except `memory` after the first call.
  const Options& options() const noexcept { return options_; }
  void set_options(const Options& options) noexcept { options_ = options; }

  // Bytes held now.
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  friend struct MeshFinderAccess;
  State* state_ = nullptr;
  Options options_;
  Pairs pairs_;
};

// The pairs of intersecting triangles of one mesh; see MeshFinder. Throws Error.
THRONG_API std::vector<Pair> find_self_intersections(const TriangleMesh& mesh,
                                                     const Options& options = {});
// The pairs of a triangle of `a` and one of `b` that have a common point. Throws Error.
THRONG_API std::vector<Pair> find_intersections(const TriangleMesh& a, const TriangleMesh& b,
                                                const Options& options = {});
// The pairs of triangles at most `distance` apart; see MeshFinder::find_within. Throws Error.
THRONG_API std::vector<Pair> find_within(const TriangleMesh& mesh, double distance,
                                         const Options& options = {});
THRONG_API std::vector<Pair> find_within(const TriangleMesh& a, const TriangleMesh& b,
                                         double distance, const Options& options = {});

// How two intersecting triangles meet. A triangle without area is a segment or a point, and all of
// it is its edges.
enum class IntersectionKind : std::uint8_t {
  crossing,  // not coplanar, and they share a point that is on no edge of either
  touching,  // not coplanar otherwise
  coplanar,  // all six vertices lie in one plane
  none,      // they do not intersect
};

// The intersection of two closed triangles: a point, the two ends of a segment, or the corners of a
// convex polygon, in the order in which the first triangle winds.
struct TriangleIntersection {
  IntersectionKind kind = IntersectionKind::none;
  std::uint8_t point_count = 0;  // 1 to 6; 0 of kind none
  DoubleVec3 points[6] = {};     // the first point_count are set
};

// Describes the intersection of each pair of triangles, of `a` and of `b`; for one mesh pass it
// twice. Pass the meshes with the transforms of the search: a pair that is apart gets kind `none`.
// Vertices that two triangles of one mesh share are points as any other. `kind` and
// `point_count` are exact. Each coordinate of a point is the exact one rounded to nearest, so equal
// points have equal coordinates in all pairs; different points that are very close may have them,
// too. Of the options, `threads`, `executor` and `stop` are used.
// Throws Error with Status::bad_mesh, e.g. for an index of a pair that is out of range.
// Cost: O(count).
THRONG_API std::vector<TriangleIntersection> describe_intersections(const TriangleMesh& a,
                                                                    const TriangleMesh& b,
                                                                    const Pair* pairs,
                                                                    std::size_t count,
                                                                    const Options& options = {});
inline std::vector<TriangleIntersection> describe_intersections(const TriangleMesh& a,
                                                                const TriangleMesh& b,
                                                                const std::vector<Pair>& pairs,
                                                                const Options& options = {}) {
  return describe_intersections(a, b, pairs.data(), pairs.size(), options);
}
inline std::vector<TriangleIntersection> describe_intersections(const TriangleMesh& a,
                                                                const TriangleMesh& b, Pairs pairs,
                                                                const Options& options = {}) {
  return describe_intersections(a, b, pairs.data(), pairs.size(), options);
}

// The same into out[0 .. count-1], without an allocation and without exceptions. After an error the
// values of `out` are not specified.
[[nodiscard]] THRONG_API Result describe_intersections_into(const TriangleMesh& a,
                                                            const TriangleMesh& b,
                                                            const Pair* pairs, std::size_t count,
                                                            TriangleIntersection* out,
                                                            const Options& options = {}) noexcept;

}  // namespace throng
