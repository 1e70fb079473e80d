// Subcommand mesh: intersecting triangles of one mesh and of two, compared with CGAL and FCL. All
// methods in turn; medians. The pairs are compared.
#include <throng/throng.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/numbers.hpp"
#include "apps/meshes/mesh_file.hpp"
#include "apps/report/format.hpp"
#include "apps/report/table.hpp"
#include "apps/scenes/meshes.hpp"
#include "bench/competitors/meshes.hpp"
#include "bench/require.hpp"
#include "bench/subcommands.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

using Pairs = std::vector<Pair>;

// One method on one case.
struct Timed {
  std::string library;
  unsigned threads;
  std::function<std::size_t()> run;  // returns the number of pairs
  std::vector<double> times = {};
  std::size_t found = 0;
};

struct MeshCommand {
  CaseOptions options;
  Results results;
  report::Table summary{"Triangle meshes, ms",
                        {"case", "triangles", "candidates", "pairs", "exact tests", "Throng",
                         "threads", "other library", "ms", "threads", "ratio", "bytes/triangle"}};

  explicit MeshCommand(CaseOptions o) : options(std::move(o)), results(options.output) {}
};

Mesh generated(const char* name, std::size_t triangles) {
  scenes::MeshSpec spec;
  spec.name = name;
  spec.triangles = triangles;
  scenes::GeneratedMesh mesh = scenes::make_mesh(spec);
  return {std::move(mesh.vertices), std::move(mesh.triangles)};
}

Mesh moved(Mesh mesh, const Vec3& by) {
  for (Vec3& v : mesh.vertices) v = {v.x + by.x, v.y + by.y, v.z + by.z};
  return mesh;
}

// The mean length of the edges.
double mean_edge(const Mesh& mesh) {
  double sum = 0;
  const auto length = [&](std::uint32_t i, std::uint32_t k) {
    const DoubleVec3 a = Vertices(mesh.vertices)[i], b = Vertices(mesh.vertices)[k];
    return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
  };
  for (const Triangle& t : mesh.triangles)
    sum += length(t.a, t.b) + length(t.b, t.c) + length(t.c, t.a);
  return sum / static_cast<double>(std::max<std::size_t>(1, 3 * mesh.triangles.size()));
}

Pairs sorted(Pairs pairs) {
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

bool has_no_area(const Mesh& mesh, std::uint32_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  const DoubleVec3 a = Vertices(mesh.vertices)[t.a], b = Vertices(mesh.vertices)[t.b],
                   c = Vertices(mesh.vertices)[t.c];
  // Differences of floats and their products are nearly exact: a sum near 0 is taken as 0.
  const double u[3] = {b.x - a.x, b.y - a.y, b.z - a.z}, v[3] = {c.x - a.x, c.y - a.y, c.z - a.z};
  double normal = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const double one = u[k] * v[(k + 1) % 3], two = u[(k + 1) % 3] * v[k];
    normal += std::abs(one - two);
    size += std::abs(one) + std::abs(two);
  }
  return normal <= 0x1p-50 * size;
}

// CGAL reports a triangle without area once, as a pair with itself, and no pair of it with others.
void require_equal(const Mesh& mesh, const Pairs& own, const Pairs& other, const std::string& name,
                   const std::string& what) {
  Pairs differing;
  std::set_symmetric_difference(own.begin(), own.end(), other.begin(), other.end(),
                                std::back_inserter(differing));
  if (differing.empty()) return;
  const auto explained = [&](Pair p) {
    return has_no_area(mesh, p.first) || has_no_area(mesh, p.second);
  };
  const auto wrong = std::find_if_not(differing.begin(), differing.end(), explained);
  if (wrong == differing.end()) {
    fmt::print("{}: Throng {} pairs, {} {}: {} differ, all of triangles without area\n", what,
               own.size(), name, other.size(), differing.size());
    return;
  }
  throw common::Failure(
      fmt::format("{}: Throng found {} pairs, {} found {}; triangles {} and {} are a pair for {}",
                  what, own.size(), name, other.size(), wrong->first, wrong->second,
                  std::binary_search(own.begin(), own.end(), *wrong) ? "Throng" : name),
      common::exit_differs);
}

void run_rounds(std::vector<Timed>& all, int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (Timed& t : all) t.times.push_back(time_ms([&] { t.found = t.run(); }));
}

// A case: one mesh, two, or one within a distance.
struct Search {
  std::string name;
  std::string setting;  // "self", "two meshes", "within ..."
  std::uint64_t triangles;
  std::function<MeshResult(MeshFinder&)> find;
  // Into the caller's memory: what the finder then holds is neither mesh nor pairs.
  std::function<MeshResult(MeshFinder&, Pair*, std::size_t)> find_into;
};

// Measures Throng, and the others in turn. `compare` is given the pairs of Throng.
void measure(MeshCommand& command, const Search& search, std::vector<Timed> others, int rounds,
             const std::function<void(const Pairs&)>& compare) {
  const CaseOptions& options = command.options;
  std::vector<std::unique_ptr<MeshFinder>> finders;
  std::vector<Timed> all;
  MeshResult counts;
  for (const unsigned threads : options.threads) {
    Options o;
    o.threads = threads;
    finders.push_back(std::make_unique<MeshFinder>(o));
    MeshFinder& finder = *finders.back();
    all.push_back({"Throng MeshFinder", threads, [&finder, &search] {
                     require(search.find(finder));
                     return finder.pairs().size();
                   }});
  }
  // The first round is not timed.
  counts = search.find(*finders.front());
  require(counts);
  const Pairs own = sorted(Pairs(finders.front()->pairs().begin(), finders.front()->pairs().end()));
  for (auto& other : others) other.run();
  compare(own);
  std::uint64_t held = 0;
  {
    Pairs memory(own.size() + 1);
    MeshFinder finder(finders.front()->options());
    require(search.find_into(finder, memory.data(), memory.size()));
    held = finder.memory_bytes();
  }
  const auto own_count = static_cast<std::ptrdiff_t>(all.size());
  all.insert(all.end(), std::make_move_iterator(others.begin()),
             std::make_move_iterator(others.end()));
  run_rounds(all, rounds);

  Row row;
  row.kind = "mesh";
  row.name = search.name;
  row.objects = search.triangles;
  row.setting = search.setting;
  row.found = own.size();
  row.checksum = pair_checksum(own.data(), own.size());
  for (Timed& t : all) {
    Row timed = row;
    timed.library = t.library;
    timed.threads = t.threads;
    timed.metric = "search_ms";
    timed.found = t.found;
    if (t.found != own.size()) timed.checksum.reset();
    set_samples(timed, t.times);
    command.results.add(std::move(timed));
  }
  row.library = "Throng MeshFinder";
  row.threads = options.threads.front();
  const std::pair<const char*, double> more[] = {
      {"candidates_count", static_cast<double>(counts.candidates)},
      {"exact_tests_count", static_cast<double>(counts.exact_tests)},
      {"held_bytes", static_cast<double>(held)}};
  for (const auto& [metric, value] : more) {
    row.metric = metric;
    row.value = value;
    command.results.add(row);
  }
  command.results.show(fmt::format("{}, {} triangles, {}", search.name,
                                   report::format_count(search.triangles), search.setting));

  const auto median_of = [](const Timed& t) {
    Row r;
    set_samples(r, t.times);
    return r.value;
  };
  const auto faster = [&](const Timed& a, const Timed& b) { return median_of(a) < median_of(b); };
  const auto first_other = all.begin() + own_count;
  const Timed& best = *std::min_element(all.begin(), first_other, faster);
  const std::string shared[] = {
      fmt::format("{}, {}", search.name, search.setting), report::format_short(search.triangles),
      report::format_count(counts.candidates), report::format_count(own.size()),
      report::format_count(counts.exact_tests)};
  for (auto other = first_other; other == first_other || other != all.end(); ++other) {
    std::vector<std::string> cells(std::begin(shared), std::end(shared));
    cells.push_back(report::format_ms(median_of(best)));
    cells.push_back(std::to_string(best.threads));
    if (other != all.end()) {
      cells.push_back(other->library);
      cells.push_back(report::format_ms(median_of(*other)));
      cells.push_back(std::to_string(other->threads));
      cells.push_back(report::format_ratio(median_of(*other) / median_of(best)));
    } else {
      cells.resize(cells.size() + 4);
    }
    cells.push_back(
        fmt::format("{:.1f}", static_cast<double>(held) / static_cast<double>(search.triangles)));
    command.summary.add_row(std::move(cells));
    if (other == all.end()) break;
  }
}

// The intersections of one mesh, then what is within distances.
void measure_mesh(MeshCommand& command, const std::string& name, const Mesh& given, int rounds) {
  const CaseOptions& options = command.options;
  SelfIntersectionMethods cgal;
  if (options.competitors)
    cgal = self_intersection_competitors(
        given, *std::max_element(options.threads.begin(), options.threads.end()));
  else
    cgal.mesh = given;
  const Mesh& mesh = cgal.mesh;
  if (mesh.vertices.size() != given.vertices.size()) {
    fmt::print("{}: {} vertices are split, so that the surface is a manifold\n", name,
               mesh.vertices.size() - given.vertices.size());
  }
  const TriangleMesh view = mesh.view();
  Search search;
  search.name = name;
  search.setting = "self";
  search.triangles = mesh.triangles.size();
  search.find = [&](MeshFinder& finder) { return finder.find(view); };
  search.find_into = [&](MeshFinder& finder, Pair* out, std::size_t capacity) {
    return finder.find(view, out, capacity);
  };
  std::vector<Timed> others;
  others.reserve(cgal.methods.size());
  for (const auto& method : cgal.methods) {
    others.push_back({method->name(), method->threads(), [&] { return method->run(); }});
  }
  const auto compare = [&](const Pairs& own) {
    for (const auto& method : cgal.methods)
      require_equal(mesh, own, sorted(method->pairs()), method->name(), name);
  };
  measure(command, search, std::move(others), rounds, compare);

  for (const double share : {0.05, 0.5}) {
    const double distance = share * mean_edge(mesh);
    search.setting = fmt::format("within {:g} edges", share);
    search.find = [&](MeshFinder& finder) { return finder.find_within(view, distance); };
    search.find_into = [&](MeshFinder& finder, Pair* out, std::size_t capacity) {
      return finder.find_within(view, distance, out, capacity);
    };
    measure(command, search, {}, rounds, [](const Pairs&) {});
  }
}

void measure_two(MeshCommand& command, std::size_t triangles, int rounds) {
  const Mesh a = generated("sphere", triangles), b = moved(a, {1.5f, 0.31f, 0.17f});
  const TriangleMesh view_a = a.view(), view_b = b.view();
  Search search;
  search.name = "two spheres";
  search.setting = "two meshes";
  search.triangles = a.triangles.size() + b.triangles.size();
  search.find = [&](MeshFinder& finder) { return finder.find(view_a, view_b); };
  search.find_into = [&](MeshFinder& finder, Pair* out, std::size_t capacity) {
    return finder.find(view_a, view_b, out, capacity);
  };
  const auto fcl = command.options.competitors ? mesh_pair_competitors(a, b)
                                               : std::vector<std::unique_ptr<MeshPairMethod>>();
  std::vector<Timed> others;
  others.reserve(fcl.size());
  for (const auto& method : fcl)
    others.push_back({method->name(), 1, [&] { return method->run(); }});
  // FCL's test of two triangles is not exact: a difference is reported, not a failure.
  const auto compare = [&](const Pairs& own) {
    for (const auto& method : fcl) {
      Pairs differing;
      const Pairs other = sorted(method->pairs());
      std::set_symmetric_difference(own.begin(), own.end(), other.begin(), other.end(),
                                    std::back_inserter(differing));
      fmt::print("{}: Throng {} pairs, {} {}: {} differ\n", search.name, own.size(), method->name(),
                 other.size(), differing.size());
    }
  };
  measure(command, search, std::move(others), rounds, compare);
}

int rounds_for(std::size_t triangles) {
  return triangles <= 10'000 ? 41 : (triangles <= 200'000 ? 15 : 5);
}

}  // namespace

int mesh_command(int argc, char** argv) {
  CaseOptions options;
  CLI::App app{"Intersecting triangles of meshes.", "throng-bench mesh"};
  std::vector<std::string> sizes, files;
  app.add_option("files", files, "Meshes in .obj, .off, .ply or .stl files, instead of scenes");
  app.add_flag_callback(
      "--no-competitors", [&] { options.competitors = false; }, "Only Throng");
  app.add_option("--triangles", sizes, "Numbers of triangles, such as 1K,4M")->delimiter(',');
  int status = 0;
  if (!parse_case_options(app, options, "CASE-TRIANGLES", argc, argv, status)) return status;
  MeshCommand command(std::move(options));
  const CaseOptions& a = command.options;
  std::vector<std::size_t> counts = {1'000, 100'000, 1'000'000};
  if (!sizes.empty()) {
    counts.clear();
    for (const std::string& text : sizes)
      counts.push_back(common::parse_count(text, "--triangles", 1'000, 16'000'000));
  }
  for (const char* const name : {"sphere", "crumpled", "spiral", "knot", "soup"}) {
    if (!files.empty()) break;
    std::size_t last = 0;
    for (const std::size_t wanted : counts) {
      const std::size_t count = std::max<std::size_t>(1'000, a.objects(wanted));
      if (count == last || !a.wanted(fmt::format("{}-{}", name, count))) continue;
      last = count;
      measure_mesh(command, name, generated(name, count), a.rounds_of(rounds_for(count)));
    }
  }
  for (const std::string& file : files) {
    meshes::MeshFile read = meshes::read_mesh(file);
    const std::size_t count = read.triangles.size();
    measure_mesh(command, std::filesystem::path(file).stem().string(),
                 {std::move(read.vertices), std::move(read.triangles)},
                 a.rounds_of(rounds_for(count)));
  }
  const std::size_t each = a.objects(100'000);
  if (files.empty() && a.wanted(fmt::format("two spheres-{}", each)))
    measure_two(command, each, a.rounds_of(rounds_for(each)));
  fmt::print("{}\n", command.summary.text());
  return common::exit_done;
}

}  // namespace throng::bench
