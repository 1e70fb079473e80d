// describe_intersections: its arguments, errors and threads.
#include <algorithm>
#include <cmath>
#include <new>

#include <throng/throng.hpp>

#include "base/cancellation.hpp"
#include "base/float_state.hpp"
#include "base/mutex.hpp"
#include "base/threads.hpp"
#include "mesh/describe.hpp"
#include "mesh/transform.hpp"
#include "validate.hpp"
#include "validate_mesh.hpp"

namespace throng {
namespace {

using ull = unsigned long long;

// A mesh, and how messages name it.
struct NamedMesh {
  const TriangleMesh& mesh;
  const char* name;
  bool moves = !mesh::is_identity(mesh.transform);

  const Triangle& triangle(std::uint32_t i) const noexcept {
    const auto* const bytes = reinterpret_cast<const char*>(mesh.triangles.data);
    return *reinterpret_cast<const Triangle*>(bytes + i * mesh.triangles.stride_bytes);
  }
  // The corners of a triangle. False if one is not valid: `vertex` is its index.
  bool read(std::uint32_t i, mesh::TrianglePoints& points, std::uint32_t& vertex) const noexcept {
    const Triangle& t = triangle(i);
    const std::uint32_t index[3] = {t.a, t.b, t.c};
    for (int k = 0; k < 3; ++k) {
      vertex = index[k];
      if (vertex >= mesh.vertices.size()) return false;
      DoubleVec3& p = points.p[k];
      p = mesh.vertices[vertex];
      if (moves) p = mesh::transformed(mesh.transform, p);
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return false;
    }
    return true;
  }
};

class Description {
 public:
  Description(const TriangleMesh& a, const TriangleMesh& b, const Pair* pairs,
              std::size_t count) noexcept
      : a_{a, &a == &b ? "the mesh" : "the first mesh"},
        b_{b, &a == &b ? "the mesh" : "the second mesh"},
        pairs_(pairs),
        count_(count) {}

  bool valid(const Options& options, Result& r) const noexcept {
    if (!valid_executor(options.executor, r)) return false;
    if (count_ != 0 && !pairs_) {
      set_message(r, "the array of the pairs to describe is null; give the address of %llu",
                  ull{count_});
      return refuse(r, Status::bad_option);
    }
    return valid_mesh(a_.mesh, a_.name, r) && valid_mesh(b_.mesh, b_.name, r);
  }

  // Sets status and message for the first pair that is not valid.
  void run(const Options& options, TriangleIntersection* out, Result& r) noexcept {
    base::Cancellation stop(options.stop);
    const unsigned tasks = base::threads_of(options);
    base::ChunkQueue chunks(count_, tasks, 64);
    base::Mutex mutex;
    auto task = [&](unsigned t) {
      std::size_t first_bad = count_;
      for (std::size_t begin, end; !stop() && chunks.take(t, begin, end);)
        for (std::size_t i = begin; i < end; ++i)
          if (!describe(pairs_[i], out[i])) first_bad = std::min(first_bad, i);
      const std::lock_guard<base::Mutex> lock(mutex);
      first_bad_ = std::min(first_bad_, first_bad);
    };
    base::run_tasks(base::executor_of(options), tasks, task);
    if (stop.seen()) {
      set_message(r, "stopped by Options::stop");
      r.status = Status::stopped;
    } else if (first_bad_ < count_) {
      explain_bad_pair(r);
    }
  }

 private:
  bool describe(const Pair& pair, TriangleIntersection& out) const noexcept {
    mesh::TrianglePoints a, b;
    std::uint32_t vertex;
    if (pair.first >= a_.mesh.size() || pair.second >= b_.mesh.size() ||
        !a_.read(pair.first, a, vertex) || !b_.read(pair.second, b, vertex))
      return false;
    out = mesh::describe_intersection(a, b);
    return true;
  }

  void explain_bad_pair(Result& r) const noexcept {
    const Pair pair = pairs_[first_bad_];
    r.status = Status::bad_mesh;
    r.invalid_count = 1;
    r.first_invalid = first_bad_;
    for (const bool second : {false, true}) {
      const NamedMesh& m = second ? b_ : a_;
      const std::uint32_t i = second ? pair.second : pair.first;
      if (i < m.mesh.size()) continue;
      set_message(r,
                  "pair %llu has triangle %llu as its %s, but %s has %llu triangle%s, counted from "
                  "0; pass the meshes for which the pairs were found, in the same order",
                  ull{first_bad_}, ull{i}, second ? "second" : "first", m.name, ull{m.mesh.size()},
                  m.mesh.size() == 1 ? "" : "s");
      return;
    }
    mesh::TrianglePoints points;
    std::uint32_t vertex = 0;
    const bool second = a_.read(pair.first, points, vertex);
    if (second) b_.read(pair.second, points, vertex);
    const NamedMesh& m = second ? b_ : a_;
    r.first_invalid = second ? pair.second : pair.first;
    explain_bad_triangle(m.mesh, m.name, r.first_invalid, vertex, "", r);
  }

  NamedMesh a_, b_;
  const Pair* pairs_;
  std::size_t count_;
  std::size_t first_bad_ = ~std::size_t{0};
};

}  // namespace

Result describe_intersections_into(const TriangleMesh& a, const TriangleMesh& b, const Pair* pairs,
                                   std::size_t count, TriangleIntersection* out,
                                   const Options& options) noexcept {
  const base::FloatState float_state;
  Result r;
  Description description(a, b, pairs, count);
  if (!description.valid(options, r)) return r;
  if (count != 0 && !out) {
    set_message(r, "the array for the intersections is null; give the address of room for %llu",
                ull{count});
    (void)refuse(r, Status::bad_option);
    return r;
  }
  description.run(options, out, r);
  if (r.ok()) r.found = r.written = count;
  return r;
}

std::vector<TriangleIntersection> describe_intersections(const TriangleMesh& a,
                                                         const TriangleMesh& b, const Pair* pairs,
                                                         std::size_t count,
                                                         const Options& options) {
  Result r;
  std::vector<TriangleIntersection> descriptions;
  try {
    // Without pairs, the call explains what is missing.
    if (pairs) descriptions.resize(count);
  } catch (...) {
    explain_failure(r, {Status::out_of_memory, count * sizeof(TriangleIntersection)},
                    "describe fewer pairs at once");
    throw Error(r);
  }
  r = describe_intersections_into(a, b, pairs, count, descriptions.data(), options);
  if (!r.ok()) throw Error(r);
  return descriptions;
}

}  // namespace throng
