#include "mesh/contact.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>

#include "base/float_state.hpp"
#include "base/mutex.hpp"
#include "base/parallel_region.hpp"
#include "base/profile.hpp"
#include "base/threads.hpp"
#include "mesh/contact_boxes.hpp"

namespace throng::mesh {
namespace {

// Elements per chunk of a pass over all of them.
constexpr std::size_t chunk = 4096;

template <class Element>
constexpr std::size_t corners = sizeof(Element) / sizeof(std::uint32_t);
inline void vertices_of(const Edge& e, std::uint32_t (&v)[2]) noexcept { v[0] = e.a, v[1] = e.b; }
inline void vertices_of(const Triangle& t, std::uint32_t (&v)[3]) noexcept {
  v[0] = t.a, v[1] = t.b, v[2] = t.c;
}

// The elements of one side of a search, as arrays of vertices. A vertex is an element, too.
struct VertexElements {
  static constexpr std::size_t size = 1;
  void get(std::uint32_t i, std::uint32_t (&v)[1]) const noexcept { v[0] = i; }
};
template <class Element>
struct MeshElements {
  static constexpr std::size_t size = corners<Element>;
  Strided<Element> elements;
  void get(std::uint32_t i, std::uint32_t (&v)[size]) const noexcept {
    vertices_of(elements[i], v);
  }
};

// Keeps pairs of elements without a common vertex, and applies filters and rings. No function has
// a branch that depends on a pair's result, which is unpredictable.
template <class First, class Second>
class ContactTest final : public grid::PairTest {
 public:
  ContactTest(const First& first, const Second& second, const ContactMesh& mesh,
              const VertexRings* rings) noexcept
      : first_(first), second_(second), group_(mesh.group), mask_(mesh.mask), rings_(rings) {}

  std::size_t keep(Pair* pairs, std::size_t count) const override {
    count = compact(pairs, count, [](const auto& a, const auto& b) {
      bool shared = false;
      for (const std::uint32_t u : a)
        for (const std::uint32_t v : b) shared |= u == v;
      return !shared;
    });
    if (group_ || mask_) {
      count = compact(pairs, count, [this](const auto& a, const auto& b) {
        bool allowed = false;
        for (const std::uint32_t u : a)
          for (const std::uint32_t v : b) allowed |= may_collide(u, v);
        return allowed;
      });
    }
    return rings_ ? keep_beyond_rings(pairs, count) : count;
  }
  void restart() noexcept override {}

 private:
  template <class Keep>
  std::size_t compact(Pair* pairs, std::size_t count, const Keep& keep) const {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Pair pair = pairs[i];
      std::uint32_t a[First::size], b[Second::size];
      first_.get(pair.first, a);
      second_.get(pair.second, b);
      pairs[kept] = pair;
      kept += keep(a, b);
    }
    return kept;
  }

  bool may_collide(std::uint32_t u, std::uint32_t v) const noexcept {
    const std::uint32_t all = ~std::uint32_t{0};
    const std::uint32_t group_u = group_ ? group_[u] : all, group_v = group_ ? group_[v] : all;
    const std::uint32_t mask_u = mask_ ? mask_[u] : all, mask_v = mask_ ? mask_[v] : all;
    return ((group_u & mask_v) != 0) & ((group_v & mask_u) != 0);
  }

  // Reads the lists of the first element's vertices; their lines are fetched some pairs ahead.
  std::size_t keep_beyond_rings(Pair* pairs, std::size_t count) const {
    constexpr std::size_t ahead = 8;
    std::size_t kept = 0;
    std::uint32_t a[First::size], b[Second::size];
    for (std::size_t i = 0; i < count; ++i) {
      if (i + ahead < count) {
        first_.get(pairs[i + ahead].first, a);
        for (const std::uint32_t u : a) rings_->prefetch(u);
      }
      const Pair pair = pairs[i];
      first_.get(pair.first, a);
      second_.get(pair.second, b);
      bool near = false;
      for (const std::uint32_t u : a) {
        const std::uint32_t* const end = rings_->end(u);
        for (const std::uint32_t* at = rings_->begin(u); at != end; ++at)
          for (const std::uint32_t v : b) near |= *at == v;
      }
      pairs[kept] = pair;
      kept += !near;
    }
    return kept;
  }

  First first_;
  Second second_;
  Strided<std::uint32_t> group_, mask_;
  const VertexRings* rings_;
};

}  // namespace

struct ContactSearch::Call {
  const ContactMesh& mesh;
  double radius;
  Options options;
  const Executor* executor;
  unsigned tasks;
  base::Cancellation stop;
  InvalidElements& invalid;
  Result result;

  // Calls body(begin, end) for chunks of 0 .. count-1, from any thread.
  template <class Body>
  void for_each_chunk(std::size_t count, const Body& body) {
    base::parallel_for(*executor, tasks, count / chunk + (count % chunk != 0),
                       [&](std::size_t c, unsigned) {
                         if (!stop()) body(c * chunk, std::min(count, (c + 1) * chunk));
                       });
  }
};

ContactSearch::ContactSearch(std::pmr::memory_resource* memory, std::size_t already_held) noexcept
    : engine_(memory, already_held),
      vertex_boxes_(engine_.memory()),
      edge_boxes_(engine_.memory()),
      face_boxes_(engine_.memory()),
      edge_filters_(engine_.memory()),
      face_filters_(engine_.memory()),
      rings_(engine_.memory()),
      vertex_face_(engine_.memory()),
      edge_edge_(engine_.memory()),
      edge_vertex_(engine_.memory()) {}

std::size_t ContactSearch::held() const noexcept { return engine_.memory().held(); }

namespace {

// A coordinate array of Real, read without the test of its type for each vertex.
template <class Real>
struct VertexReader {
  const char* data;
  std::size_t stride;
  explicit VertexReader(const Vertices& v) noexcept
      : data(static_cast<const char*>(v.data())), stride(v.stride_bytes()) {}
  DoubleVec3 operator[](std::size_t i) const noexcept {
    const Real* const p = reinterpret_cast<const Real*>(data + i * stride);
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
};
template <class Use>
void with_reader(const Vertices& v, const Use& use) {
  v.is_float() ? use(VertexReader<float>(v)) : use(VertexReader<double>(v));
}

}  // namespace

void ContactSearch::fill_vertex_boxes(Call& call) {
  THRONG_RANGE("boxes of vertices");
  const ContactMesh& mesh = call.mesh;
  const std::size_t n = mesh.start.size();
  Box* const boxes = vertex_boxes_.ensure(n);
  const bool flat = is_flat(mesh);
  std::atomic<std::uint64_t> inactive{0};
  with_reader(mesh.start, [&](const auto start) {
    with_reader(mesh.end.size() ? mesh.end : mesh.start, [&](const auto end) {
      call.for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        std::uint64_t not_finite = 0;
        for (std::size_t i = first; i < last; ++i) {
          boxes[i] = swept_vertex_box(start[i], end[i], call.radius, flat);
          not_finite += !base::is_active(boxes[i]);
        }
        if (not_finite) inactive += not_finite;
      });
    });
  });
  call.result.inactive = inactive;
}

namespace {

// The boxes as the search sees them: without z in 2-D.
Boxes view_of(const Box* boxes, std::size_t count, bool flat) noexcept {
  if (!flat || count == 0) return Boxes(boxes, count);  // without elements `boxes` may be null
  return Boxes::arrays(&boxes->lower.x, &boxes->lower.y, nullptr, &boxes->upper.x, &boxes->upper.y,
                       nullptr, count, sizeof(Box));
}

}  // namespace

// Returns false if an element is invalid.
template <class Element>
bool ContactSearch::fill_element_boxes(Call& call, const Strided<Element>& elements,
                                       base::Buffer<Box>& boxes,
                                       base::Buffer<std::uint32_t>& filters, Boxes& view,
                                       InvalidElements::Kind kind) {
  THRONG_RANGE("boxes of elements");
  const ContactMesh& mesh = call.mesh;
  const std::size_t n = elements.count, vertex_count = mesh.start.size();
  Box* const out = boxes.ensure(n);
  const bool filtered = mesh.group || mesh.mask;
  std::uint32_t* const groups = filtered ? filters.ensure(2 * n) : nullptr;
  std::uint32_t* const masks = filtered ? groups + n : nullptr;
  base::Mutex merge;
  InvalidElements invalid{kind, 0, 0};
  call.for_each_chunk(n, [&](std::size_t first, std::size_t last) {
    InvalidElements part{kind, 0, 0};
    for (std::size_t i = first; i < last; ++i) {
      std::uint32_t v[corners<Element>];
      vertices_of(elements[i], v);
      bool valid = true;
      for (const std::uint32_t u : v) valid &= u < vertex_count;
      if (valid) {
        Box box = vertex_boxes_[v[0]];
        for (const std::uint32_t u : v) {
          valid &= base::is_active(vertex_boxes_[u]);
          box = united(box, vertex_boxes_[u]);
        }
        out[i] = box;
      }
      if (!valid) {
        if (part.count++ == 0) part.first = i;
      } else if (filtered) {
        groups[i] = masks[i] = 0;
        for (const std::uint32_t u : v) {
          groups[i] |= mesh.group ? mesh.group[u] : ~std::uint32_t{0};
          masks[i] |= mesh.mask ? mesh.mask[u] : ~std::uint32_t{0};
        }
      }
    }
    if (part.count == 0) return;
    const std::lock_guard<base::Mutex> lock(merge);
    invalid.first = invalid.count ? std::min(invalid.first, part.first) : part.first;
    invalid.count += part.count;
  });
  view = view_of(out, n, is_flat(mesh));
  // Two elements of which no vertices may collide are dropped by the search, before the test.
  if (filtered) {
    view.filters.group = {groups, n, sizeof(std::uint32_t)};
    view.filters.mask = {masks, n, sizeof(std::uint32_t)};
  }
  if (invalid.count == 0) return true;
  call.invalid = invalid;
  return false;
}

void ContactSearch::search(Call& call, const Boxes& a, const Boxes* b, grid::PairTest& test,
                           base::Buffer<Pair>& pairs, Pairs& view) {
  Result& sum = call.result;
  if (!sum.ok() || a.empty() || (b && b->empty())) return;
  base::Output output{pairs.data(), pairs.capacity(), grid::grow_pairs, &pairs};
  const Result r = engine_.find(a, b, call.options, &output, nullptr, &test);
  sum.comparisons += r.comparisons;
  sum.visited += r.visited;
  sum.times += r.times;
  if (!r.ok()) {
    sum.status = r.status;
    sum.bytes_needed = r.bytes_needed;
    return;
  }
  sum.plan = r.plan;
  sum.found += r.found;
  view = {output.data, static_cast<std::size_t>(r.found)};
}

void ContactSearch::run(Call& call) {
  const ContactMesh& mesh = call.mesh;
  const bool flat = is_flat(mesh);
  Result& r = call.result;
  const auto start = std::chrono::steady_clock::now();
  Boxes edges, faces;
  fill_vertex_boxes(call);
  Boxes vertices = view_of(vertex_boxes_.data(), mesh.start.size(), flat);
  vertices.filters.group = mesh.group;
  vertices.filters.mask = mesh.mask;
  const bool valid = fill_element_boxes(call, mesh.edges, edge_boxes_, edge_filters_, edges,
                                        InvalidElements::Kind::edge) &&
                     (flat || fill_element_boxes(call, mesh.faces, face_boxes_, face_filters_,
                                                 faces, InvalidElements::Kind::face));
  const VertexRings* rings = nullptr;
  if (call.stop()) {
    r.status = Status::stopped;
  } else if (!valid) {
    r.status = Status::bad_mesh;
    r.first_invalid = call.invalid.first;
    r.invalid_count = call.invalid.count;
  } else if (mesh.rings != 0) {
    rings = &rings_;
    if (!rings_.build(mesh, !flat, *call.executor, call.tasks, call.stop))
      r.status = Status::stopped;
  }
  r.times.bin_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const VertexElements vertex_elements;
  const MeshElements<Edge> edge_elements{mesh.edges};
  if (flat) {
    ContactTest edge_vertex(edge_elements, vertex_elements, mesh, rings);
    search(call, edges, &vertices, edge_vertex, edge_vertex_, candidates_.edge_vertex);
    return;
  }
  ContactTest vertex_face(vertex_elements, MeshElements<Triangle>{mesh.faces}, mesh, rings);
  search(call, vertices, &faces, vertex_face, vertex_face_, candidates_.vertex_face);
  ContactTest edge_edge(edge_elements, edge_elements, mesh, rings);
  search(call, edges, nullptr, edge_edge, edge_edge_, candidates_.edge_edge);
}

Result ContactSearch::find(const ContactMesh& mesh, double radius, const Options& options,
                           InvalidElements& invalid) {
  THRONG_RANGE("contact candidates");
  const auto start = std::chrono::steady_clock::now();
  candidates_ = {};
  const std::uint64_t elements =
      std::uint64_t{mesh.start.size()} + mesh.edges.count + mesh.faces.count;
  const unsigned tasks = grid::threads_for(elements, options);
  const Executor& executor = base::executor_of(options);
  Call call{mesh, radius, options, &executor, tasks, base::Cancellation(options.stop), invalid, {}};
  engine_.memory().set_cap(0);
  call.options.threads = tasks;
  try {
    base::ParallelRegion::run(executor, tasks, [&](const Executor& region) {
      call.executor = call.options.executor = &region;
      run(call);
    });
  } catch (const base::AllocationFailed& failed) {
    call.result.status = Status::out_of_memory;
    call.result.bytes_needed = failed.bytes;
  }
  Result& r = call.result;
  r.plan.threads = tasks;
  if (r.ok()) {
    r.written = r.found;
  } else {
    candidates_ = {};
    r.found = r.inactive = 0;
  }
  r.times.total_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return call.result;
}

}  // namespace throng::mesh
