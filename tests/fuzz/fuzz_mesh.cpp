// The pairs of any meshes are those of a double loop over the rule: with every instruction set, on
// one thread and two, in every form, through C++ and through C with any options. How each pair
// meets agrees with the rule.
#include <throng/throng.h>

#include <cstdlib>
#include <vector>

#include <throng/throng.hpp>

#include "fuzz/target.hpp"
#include "mesh/mesh_scene.hpp"
#include "support/aligned_memory.hpp"
#include "support/configs.hpp"

namespace throng::tests {
namespace {

void must(bool good, const std::string& what) {
  if (!good) throw Difference(what);
}

using Found = std::vector<Pair>;

// ---- C++ ----------------------------------------------------------------------------------------

// The finders keep the memory of earlier meshes.
struct Searcher {
  std::string name;
  MeshFinder finder;
};
std::vector<Searcher>& searchers() {
  static std::vector<Searcher> all = [] {
    std::vector<Searcher> made;
    for (const Isa isa : supported_isas()) {
      for (const unsigned threads : {1u, 2u}) {
        Options options;
        options.isa = isa;
        options.threads = threads;
        made.push_back(
            {std::string(to_string(isa)) + "_" + std::to_string(threads), MeshFinder(options)});
      }
    }
    return made;
  }();
  return all;
}

Found to_found(const Pairs& pairs) { return {pairs.begin(), pairs.end()}; }

enum class Form : std::uint8_t { own, buffer, consumer };

struct Answered {
  MeshResult result;
  Found pairs;
};
Answered search(MeshFinder& finder, const MeshScene& s, Form form, std::size_t capacity) {
  const TriangleMesh a = s.a.view(), b = s.b.view();
  Answered answer;
  const auto call = [&](const auto&... more) {
    if (s.within)
      return s.two ? finder.find_within(a, b, s.distance, more...)
                   : finder.find_within(a, s.distance, more...);
    return s.two ? finder.find(a, b, more...) : finder.find(a, more...);
  };
  switch (form) {
    case Form::own:
      answer.result = call();
      answer.pairs = to_found(finder.pairs());
      break;
    case Form::buffer: {
      Found out(capacity + 1, Pair{7, 7});
      answer.result = call(out.data(), capacity);
      must(out[capacity] == Pair{7, 7}, "wrote past the end");
      out.resize(answer.result.written);
      answer.pairs = out;
      break;
    }
    case Form::consumer: {
      const auto take = [&answer](const Pair* pairs, std::size_t count) {
        answer.pairs.insert(answer.pairs.end(), pairs, pairs + count);
        return true;
      };
      if (s.within)
        answer.result = s.two ? finder.consume_within(a, b, s.distance, take)
                              : finder.consume_within(a, s.distance, take);
      else
        answer.result = s.two ? finder.consume(a, b, take) : finder.consume(a, take);
      break;
    }
  }
  return answer;
}

// A copied scene: too large for all algorithms and instruction sets.
bool is_large(const MeshScene& s) { return s.a.triangle_count > 1000; }

void check_finders(Bytes& bytes, const MeshScene& s, const Found& want, const BadTriangles& bad) {
  const auto drawn = static_cast<Algorithm>(bytes.below(3));
  const Algorithm algorithm = is_large(s) ? Algorithm::grid : drawn;
  const bool canonical = bytes.one_in(2);
  const auto form = static_cast<Form>(bytes.below(3));
  const std::size_t capacity =
      bytes.one_in(3) ? bytes.below(static_cast<std::uint32_t>(want.size() + 1)) : want.size();
  bool first = true;
  std::uint64_t candidates = 0;
  for (Searcher& searcher : searchers()) {
    if (is_large(s) && &searcher != &searchers().back()) continue;
    Options options = searcher.finder.options();
    options.algorithm = algorithm;
    options.order = canonical ? Order::canonical : Order::any;
    searcher.finder.set_options(options);
    const Answered got = search(searcher.finder, s, form, capacity);
    const auto holds = [&](bool good, const std::string& what) {
      must(good,
           searcher.name + " " + to_string(algorithm) + ": " + what + " " + got.result.message);
    };
    if (bad.count != 0) {
      holds(got.result.status == Status::bad_mesh, "bad triangles were accepted");
      holds(got.result.first_invalid == bad.first && got.result.invalid_count == bad.count,
            "bad triangles miscounted");
      continue;
    }
    holds(got.result.found == want.size(),
          "found " + std::to_string(got.result.found) + ", not " + std::to_string(want.size()));
    const bool is_short = form == Form::buffer && capacity < want.size();
    holds(got.result.status == (is_short ? Status::buffer_too_small : Status::ok), "status");
    holds(got.result.candidates >= want.size(), "fewer candidates than pairs");
    holds(first || got.result.candidates == candidates, "the number of candidates differs");
    first = false;
    candidates = got.result.candidates;
    if (is_short) continue;
    const std::string difference = pairs_difference(got.pairs, want);
    holds(difference.empty(), difference);
    if (canonical) holds(got.pairs == want, "not in canonical order");
  }
}

// ---- within a distance, exactly -----------------------------------------------------------------

// Of some pairs: none within the distance is lost, none is reported that is beyond it by one part
// in 10^12. Exact, and slow.
void check_distances(Bytes& bytes, const MeshScene& s, const Found& want) {
  const SceneMesh& second = s.second();
  if (s.a.triangle_count == 0 || second.triangle_count == 0) return;
  for (int n = 0; n < 8; ++n) {
    const std::uint32_t i = bytes.below(static_cast<std::uint32_t>(s.a.triangle_count));
    const std::uint32_t j = bytes.below(static_cast<std::uint32_t>(second.triangle_count));
    if (!s.two && (i >= j || share_a_vertex(s.a.triangle(i), s.a.triangle(j)))) continue;
    if (!filters_allow(s.a, i, second, j)) continue;
    const mesh::TrianglePoints a = s.a.points(i), b = second.points(j);
    const bool is_found = std::binary_search(want.begin(), want.end(), Pair{i, j});
    if (is_found) {
      const double most = s.distance * (1 + 1e-12);
      must(mesh::triangles_within_exact(a, b, std::isfinite(most) ? most : s.distance),
           "a pair is beyond the distance");
    } else {
      must(!mesh::triangles_within_exact(a, b, s.distance), "a pair within the distance is lost");
    }
  }
}

// ---- how pairs meet -----------------------------------------------------------------------------

void check_descriptions(Bytes& bytes, const MeshScene& s) {
  const SceneMesh& second = s.second();
  if (s.a.triangle_count == 0 || second.triangle_count == 0) return;
  Found pairs;
  for (int n = 0; n < 12; ++n)
    pairs.push_back({bytes.below(static_cast<std::uint32_t>(s.a.triangle_count)),
                     bytes.below(static_cast<std::uint32_t>(second.triangle_count))});
  const TriangleMesh a = s.a.view(), b = second.view();
  const auto found = describe_intersections(a, b, pairs.data(), pairs.size());
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const mesh::TrianglePoints p = s.a.points(pairs[n].first), q = second.points(pairs[n].second);
    must((found[n].point_count != 0) == mesh::triangles_meet(p, q),
         "the description and the rule disagree");
    must(found[n].point_count <= 6 && found[n].kind <= IntersectionKind::none &&
             (found[n].point_count == 0) == (found[n].kind == IntersectionKind::none),
         "a description is out of range");
    // Points lie in the boxes of both triangles.
    for (int k = 0; k < found[n].point_count; ++k) {
      const DoubleVec3& x = found[n].points[k];
      for (const mesh::TrianglePoints& t : {p, q}) {
        const auto inside = [&](double DoubleVec3::*at) {
          return std::min({t.p[0].*at, t.p[1].*at, t.p[2].*at}) <= x.*at &&
                 x.*at <= std::max({t.p[0].*at, t.p[1].*at, t.p[2].*at});
        };
        must(inside(&DoubleVec3::x) && inside(&DoubleVec3::y) && inside(&DoubleVec3::z),
             "a point of an intersection is outside of the triangles' boxes");
      }
    }
  }
}

// ---- C ------------------------------------------------------------------------------------------

// Memory that runs out.
struct Memory {
  std::size_t left;
  static void* allocate(void* self, size_t bytes, size_t alignment) {
    Memory& m = *static_cast<Memory*>(self);
    if (bytes > m.left) return nullptr;
    m.left -= bytes;
    return allocate_aligned(bytes, alignment);
  }
  static void deallocate(void* self, void* p, size_t bytes, size_t) {
    static_cast<Memory*>(self)->left += bytes;
    free_aligned(p);
  }
};

void run_in_turn(void*, unsigned count, void (*task)(void*, unsigned), void* context) {
  for (unsigned i = 0; i < count; ++i) task(context, i);
}

throng_mesh c_view(const SceneMesh& m) {
  throng_mesh c{};
  c.vertices = {m.vertex_count, m.is_float ? m.floats.data() : nullptr,
                m.is_float ? nullptr : m.doubles.data(),
                m.vertex_gap == 0 ? 0 : m.vertex_stride_bytes()};
  c.triangles = {m.triangle_count, m.indices.data(),
                 m.triangle_gap == 0 ? 0 : m.triangle_stride_bytes()};
  if (m.moves) c.transform = &m.transform.row[0][0];
  const auto set = [](throng_strided& strided, const auto& values) {
    if (!values.empty()) strided = {values.data(), 0};
  };
  set(c.group, m.group);
  set(c.mask, m.mask);
  set(c.owner, m.owner);
  set(c.world, m.world);
  set(c.is_static, m.is_static);
  return c;
}

// Options of any values. Returns whether they are valid.
bool draw_options(Bytes& bytes, throng_options& o, Memory& memory) {
  bool valid = true;
  const auto choose = [&](int& field, int most) {
    field = bytes.between(0, most);
    if (!bytes.one_in(64)) return;
    field = bytes.one_in(2) ? most + 1 + static_cast<int>(bytes.next()) : -1;
    valid = false;
  };
  choose(o.algorithm, THRONG_ALGORITHM_GRID);
  choose(o.order, THRONG_ORDER_CANONICAL);
  choose(o.backend, THRONG_BACKEND_CPU);
  choose(o.nan, THRONG_NAN_INACTIVE);
  choose(o.inverted, THRONG_INVERTED_INACTIVE);
  choose(o.isa, THRONG_ISA_WASM);
  choose(o.stoppable, 1);
  o.threads = bytes.one_in(8) ? bytes.word() : bytes.below(4);
  if (bytes.one_in(3)) {
    o.run = run_in_turn;
    o.concurrency = bytes.below(4);
  }
  if (bytes.one_in(3)) {
    memory.left = bytes.one_in(2) ? bytes.word() % 100'000 : std::size_t{1} << 30;
    o.allocate = Memory::allocate;
    o.deallocate = Memory::deallocate;
    o.memory_self = &memory;
  }
  if (bytes.one_in(3)) o.memory_cap_bytes = bytes.word() % 1'000'000;
  if (bytes.one_in(16)) {
    valid = false;
    switch (bytes.below(4)) {
      case 0:
        o.margin = bytes.one_in(2) ? 1.0f : std::numeric_limits<float>::quiet_NaN();
        break;
      case 1:
        o.struct_bytes = bytes.below(8);
        break;
      case 2:
        o.backend = bytes.one_in(2) ? THRONG_BACKEND_CUDA : THRONG_BACKEND_EMULATED;
        break;
      default:
        o.allocate = nullptr;
        o.deallocate = Memory::deallocate;
        break;
    }
  }
  return valid;
}

// Makes one argument invalid. Returns the expected status, or THRONG_OK if it stays valid.
throng_status spoil(Bytes& bytes, throng_mesh& mesh, AffineTransform& transform, MeshScene& s) {
  static const float other_floats[3] = {};
  static const double other_doubles[3] = {};
  switch (bytes.below(7)) {
    case 0:
      if (mesh.vertices.floats)
        mesh.vertices.doubles = other_doubles;
      else
        mesh.vertices.floats = other_floats;
      return THRONG_BAD_MESH;
    case 1:
      mesh.vertices.floats = nullptr;
      mesh.vertices.doubles = nullptr;
      return THRONG_BAD_MESH;
    case 2:
      mesh.vertices.stride_bytes += 1 + bytes.below(3);
      return THRONG_BAD_MESH;
    case 3:
      mesh.triangles.stride_bytes += 1 + bytes.below(3);
      return THRONG_BAD_MESH;
    case 4:
      if (mesh.triangles.count == 0) return THRONG_OK;
      mesh.triangles.indices = nullptr;
      return THRONG_BAD_MESH;
    case 5:
      transform.row[bytes.below(3)][bytes.below(4)] = std::numeric_limits<double>::quiet_NaN();
      mesh.transform = &transform.row[0][0];
      return THRONG_BAD_MESH;
    default:
      if (!s.within) return THRONG_OK;
      s.distance = bytes.one_in(2) ? -1 : std::numeric_limits<double>::infinity();
      return THRONG_BAD_OPTION;
  }
}

struct Handle {
  throng_mesh_finder* finder;
  explicit Handle(const throng_options& options) : finder(throng_mesh_finder_create(&options)) {}
  ~Handle() { throng_mesh_finder_destroy(finder); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
};

int take(void* self, const throng_pair* pairs, size_t count) {
  for (size_t i = 0; i < count; ++i)
    static_cast<Found*>(self)->push_back({pairs[i].first, pairs[i].second});
  return 1;
}

// Pairs of which some may be out of range.
void check_c_descriptions(Bytes& bytes, const Handle& handle, const MeshScene& s,
                          const throng_mesh& a, const throng_mesh* b) {
  if (s.a.triangle_count == 0 || s.second().triangle_count == 0) return;
  Found pairs;
  for (std::uint32_t n = bytes.below(4); n > 0; --n)
    pairs.push_back({bytes.below(static_cast<std::uint32_t>(s.a.triangle_count) + bytes.below(2)),
                     bytes.below(static_cast<std::uint32_t>(s.second().triangle_count))});
  bool in_range = true;
  for (const Pair p : pairs) in_range = in_range && p.first < s.a.triangle_count;
  std::vector<throng_intersection> got(pairs.size() + 1);
  got.back().point_count = 99;
  const throng_status status = throng_mesh_finder_describe(
      handle.finder, &a, b, reinterpret_cast<const throng_pair*>(pairs.data()), pairs.size(),
      got.data());
  const std::string message = throng_mesh_finder_result(handle.finder)->message;
  must(status == (in_range ? THRONG_OK : THRONG_BAD_MESH), "C describe: " + message);
  must(got.back().point_count == 99, "C describe wrote past the end");
  if (!in_range) return must(!message.empty(), "no message");
  const TriangleMesh cpp_a = s.a.view(), cpp_b = s.second().view();
  const auto want = describe_intersections(cpp_a, cpp_b, pairs.data(), pairs.size());
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    must(got[n].kind == static_cast<std::uint8_t>(want[n].kind) &&
             got[n].point_count == want[n].point_count,
         "C and C++ describe a pair differently");
    for (int k = 0; k < want[n].point_count; ++k) {
      const DoubleVec3& p = want[n].points[k];
      const double* const q = got[n].points[k];
      must(q[0] == p.x && q[1] == p.y && q[2] == p.z, "C and C++ give different points");
    }
  }
}

void check_c(Bytes& bytes, const MeshScene& given, const Found& want, const BadTriangles& bad) {
  throng_options options;
  throng_options_init(&options);
  Memory memory{0};
  const bool valid = draw_options(bytes, options, memory);
  MeshScene s = given;
  if (is_large(s) && valid) options.algorithm = THRONG_ALGORITHM_GRID;
  throng_mesh a = c_view(s.a), b = c_view(s.b);
  const throng_mesh* const second = s.two ? &b : nullptr;
  AffineTransform transform;
  throng_status spoiled = THRONG_OK;
  if (bytes.one_in(8)) spoiled = spoil(bytes, s.two && bytes.one_in(2) ? b : a, transform, s);

  const Handle handle(options);
  if (!handle.finder) return must(false, "no handle");
  const throng_result& result = *throng_mesh_finder_result(handle.finder);
  Found got;
  throng_status status;
  const std::uint32_t form = bytes.below(3);
  const std::size_t capacity =
      bytes.one_in(3) ? bytes.below(static_cast<std::uint32_t>(want.size() + 1)) : want.size();
  if (form == 0) {
    status = s.within ? throng_mesh_finder_find_within(handle.finder, &a, second, s.distance)
                      : throng_mesh_finder_find(handle.finder, &a, second);
    std::size_t count = 0;
    const throng_pair* const pairs = throng_mesh_finder_pairs(handle.finder, &count);
    take(&got, pairs, count);
  } else if (form == 1) {
    std::vector<throng_pair> out(capacity + 1, throng_pair{7, 7});
    status = s.within
                 ? throng_mesh_finder_find_within_into(handle.finder, &a, second, s.distance,
                                                       out.data(), capacity)
                 : throng_mesh_finder_find_into(handle.finder, &a, second, out.data(), capacity);
    must(out[capacity].first == 7 && out[capacity].second == 7, "C: wrote past the end");
    take(&got, out.data(), result.written);
  } else {
    status = s.within ? throng_mesh_finder_consume_within(handle.finder, &a, second, s.distance,
                                                          take, &got)
                      : throng_mesh_finder_consume(handle.finder, &a, second, take, &got);
  }
  const std::string what = std::string("C: status ") + throng_status_text(status) + ": ";
  must(status == result.status, what + "the result has another");
  must((status == THRONG_OK) == (*result.message == 0),
       what + "message \"" + result.message + "\"");
  // Another error may be found before that of the options.
  if (!valid) return must(status != THRONG_OK, what + "the options were not valid");
  const auto isa = static_cast<Isa>(options.isa);
  const bool lacks_isa = isa != Isa::automatic && !is_supported(isa);
  if (lacks_isa && status == THRONG_UNSUPPORTED_ISA) return;
  if (spoiled != THRONG_OK) return must(status == spoiled, what + result.message);
  const bool may_run_out = options.allocate != nullptr && memory.left < std::size_t{1} << 29;
  if (may_run_out && status == THRONG_OUT_OF_MEMORY) return;
  if (form == 2 && options.memory_cap_bytes != 0 && status == THRONG_MEMORY_CAP_TOO_SMALL)
    return must(result.bytes_needed > options.memory_cap_bytes, what + result.message);
  must(!lacks_isa || bad.count != 0, what + "this processor lacks the instruction set");
  if (bad.count != 0) {
    must(status == THRONG_BAD_MESH && result.first_invalid == bad.first &&
             result.invalid_count == bad.count,
         what + result.message);
    return;
  }
  const bool is_short = form == 1 && capacity < want.size();
  must(status == (is_short ? THRONG_BUFFER_TOO_SMALL : THRONG_OK), what + result.message);
  must(result.found == want.size(), what + "miscounted");
  must(result.candidates >= want.size(), what + "fewer candidates than pairs");
  if (!is_short) {
    const std::string difference = pairs_difference(got, want);
    must(difference.empty(), what + difference);
    if (options.order == THRONG_ORDER_CANONICAL) must(got == want, what + "not in canonical order");
  }
  check_c_descriptions(bytes, handle, s, a, second);
}

}  // namespace

void run(Bytes& bytes) {
  const bool copies = bytes.one_in(64);
  MeshScene s = make_mesh_scene(bytes, 24);
  BadTriangles bad = bad_triangles(s.a);
  if (bad.count == 0 && s.two) bad = bad_triangles(s.b);
  Found want;
  if (bad.count == 0) want = expected_pairs(s);
  // Enough triangles for two threads.
  if (copies && s.a.triangle_count >= 12 && s.distance <= 8 && can_be_copied(s.a) &&
      (!s.two || can_be_copied(s.b))) {
    const auto count = static_cast<std::uint32_t>(6000 / s.a.triangle_count + 1);
    want = copied(want, s, count);
    s.a = copied(s.a, count, 32);
    if (s.two) s.b = copied(s.b, count, 32);
  }
  check_finders(bytes, s, want, bad);
  check_c(bytes, s, want, bad);
  if (bad.count != 0) return;
  if (s.within) check_distances(bytes, s, want);
  check_descriptions(bytes, s);
}

}  // namespace throng::tests
