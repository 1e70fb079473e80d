#include "mesh/vertex_rings.hpp"

#include <algorithm>

#include "base/prefetch.hpp"
#include "base/threads.hpp"

namespace throng::mesh {
namespace {

constexpr std::size_t chunk = 512;

// Calls join(a, b) for both ends of each edge, of `edges` and of the sides of `faces`.
template <class Join>
void for_each_side(const Edge* edges, std::size_t edge_count, const Triangle* faces,
                   std::size_t face_count, const Join& join) {
  const auto both = [&](std::uint32_t a, std::uint32_t b) {
    if (a == b) return;
    join(a, b);
    join(b, a);
  };
  for (std::size_t i = 0; i < edge_count; ++i) both(edges[i].a, edges[i].b);
  for (std::size_t i = 0; i < face_count; ++i) {
    both(faces[i].a, faces[i].b);
    both(faces[i].b, faces[i].c);
    both(faces[i].c, faces[i].a);
  }
}

}  // namespace

void VertexRings::prefetch(std::uint32_t vertex) const noexcept {
  base::prefetch_l1(members_.data() + begin_[vertex]);
}

bool VertexRings::is_current(const ContactMesh& mesh, std::size_t face_count) const noexcept {
  if (!built_ || rings_ != mesh.rings || vertex_count_ != mesh.start.size() ||
      edge_count_ != mesh.edges.count || face_count_ != face_count)
    return false;
  for (std::size_t i = 0; i < edge_count_; ++i) {
    const Edge &old = edges_[i], &now = mesh.edges[i];
    if (old.a != now.a || old.b != now.b) return false;
  }
  for (std::size_t i = 0; i < face_count_; ++i) {
    const Triangle &old = faces_[i], &now = mesh.faces[i];
    if (old.a != now.a || old.b != now.b || old.c != now.c) return false;
  }
  return true;
}

void VertexRings::remember(const ContactMesh& mesh, std::size_t face_count) {
  rings_ = mesh.rings;
  vertex_count_ = mesh.start.size();
  edge_count_ = mesh.edges.count;
  face_count_ = face_count;
  edges_.ensure(edge_count_);
  faces_.ensure(face_count_);
  for (std::size_t i = 0; i < edge_count_; ++i) edges_[i] = mesh.edges[i];
  for (std::size_t i = 0; i < face_count_; ++i) faces_[i] = mesh.faces[i];
}

// A counting sort by vertex: counts, then offsets, then entries.
void VertexRings::collect_neighbors() {
  // Entry v + 2 counts the neighbors of v. Summed up, entry v + 1 is the next free place of v, in
  // the end the end of v.
  std::size_t* const at = neighbor_begin_.ensure(vertex_count_ + 2);
  std::fill(at, at + vertex_count_ + 2, std::size_t{0});
  for_each_side(edges_.data(), edge_count_, faces_.data(), face_count_,
                [&](std::uint32_t a, std::uint32_t) { ++at[a + std::size_t{2}]; });
  for (std::size_t v = 1; v < vertex_count_ + 2; ++v) at[v] += at[v - 1];
  std::uint32_t* const out = neighbors_.ensure(at[vertex_count_ + 1]);
  for_each_side(edges_.data(), edge_count_, faces_.data(), face_count_,
                [&](std::uint32_t a, std::uint32_t b) { out[at[a + std::size_t{1}]++] = b; });
  // Each once: most sides belong to an edge and to two faces.
  std::uint32_t* free = out;
  for (std::size_t v = 0, begin = 0; v < vertex_count_; ++v) {
    std::uint32_t* const first = out + begin;
    std::uint32_t* const last = out + at[v + 1];
    begin = at[v + 1];
    std::sort(first, last);
    free = std::copy(first, std::unique(first, last), free);
    at[v + 1] = static_cast<std::size_t>(free - out);
  }
}

// Adds the next ring to the list.
bool VertexRings::grow(Scratch& s) const {
  std::size_t found = 0;
  for (std::size_t i = 0; i < s.outer_count; ++i) {
    const std::uint32_t u = s.outer[i];
    const std::size_t from = neighbor_begin_[u];
    const std::size_t more = neighbor_begin_[u + std::size_t{1}] - from;
    std::copy_n(neighbors_.data() + from, more, s.found.grow(found + more, found) + found);
    found += more;
  }
  std::uint32_t* const first = s.found.data();
  std::sort(first, first + found);
  std::uint32_t* const last = std::unique(first, first + found);
  std::uint32_t* const outer = s.outer.ensure(found);
  s.outer_count = static_cast<std::size_t>(
      std::set_difference(first, last, s.list.data(), s.list.data() + s.count, outer) - outer);
  std::uint32_t* const merged = s.found.ensure(s.count + s.outer_count);
  std::merge(s.list.data(), s.list.data() + s.count, outer, outer + s.outer_count, merged);
  s.list.swap(s.found);
  s.count += s.outer_count;
  return s.outer_count != 0;
}

template <class Put>
bool VertexRings::for_each_list(const Executor& executor, unsigned tasks, base::Cancellation& stop,
                                const Put& put) {
  scratch_.make(tasks);
  base::StealingRanges chunks(vertex_count_ / chunk + (vertex_count_ % chunk != 0), tasks);
  base::run_tasks_or_throw(executor, tasks, [&](unsigned task) {
    Scratch& s = scratch_[task];
    for (std::uint64_t c; !stop() && chunks.take(task, c);) {
      const std::size_t first = static_cast<std::size_t>(c) * chunk;
      for (std::size_t v = first; v < std::min(first + chunk, vertex_count_) && !stop(); ++v) {
        s.list.ensure(1)[0] = s.outer.ensure(1)[0] = static_cast<std::uint32_t>(v);
        s.count = s.outer_count = 1;
        for (unsigned ring = 0; ring < rings_ && grow(s); ++ring) {
        }
        put(v, s.list.data(), s.count);
      }
    }
  });
  scratch_.match(tasks);
  return !stop();
}

bool VertexRings::build(const ContactMesh& mesh, bool use_faces, const Executor& executor,
                        unsigned tasks, base::Cancellation& stop) {
  const std::size_t face_count = use_faces ? mesh.faces.count : 0;
  if (is_current(mesh, face_count)) return true;
  built_ = false;
  remember(mesh, face_count);
  collect_neighbors();
  std::size_t* const begin = begin_.ensure(vertex_count_ + 1);
  begin[0] = 0;
  if (!for_each_list(
          executor, tasks, stop,
          [&](std::size_t v, const std::uint32_t*, std::size_t count) { begin[v + 1] = count; }))
    return false;
  for (std::size_t v = 0; v < vertex_count_; ++v) begin[v + 1] += begin[v];
  std::uint32_t* const members = members_.ensure(begin[vertex_count_]);
  built_ = for_each_list(executor, tasks, stop,
                         [&](std::size_t v, const std::uint32_t* list, std::size_t count) {
                           std::copy_n(list, count, members + begin[v]);
                         });
  return built_;
}

}  // namespace throng::mesh
