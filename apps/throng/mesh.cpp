// throng mesh: finds the triangles of mesh files that intersect; prints counts and times.
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "apps/common/numbers.hpp"
#include "apps/meshes/mesh_file.hpp"
#include "apps/report/draw_mesh.hpp"
#include "apps/report/format.hpp"
#include "apps/report/write_png.hpp"
#include "apps/scenes/meshes.hpp"
#include "apps/scenes/output_file.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/mesh_search.hpp"
#include "apps/throng/report_json.hpp"
#include "apps/throng/search_options.hpp"

namespace throng::cli {
namespace {

using Json = nlohmann::ordered_json;

const char* help_text =
    R"(Prints the number of pairs of triangles that intersect, a checksum that does not depend on the order
of the pairs, how they meet, and times. In one mesh, triangles that share vertices by index are a pair
if they have a point in common beyond those vertices. The result is exact for the coordinates as
read: the nearest float32, or double with --double. Polygons are cut into fans from their first
vertex; triangles with a repeated index are dropped and counted. Equal positions in an STL file are
one vertex; other files keep their vertices, unless --weld is given.

Examples:
  throng mesh model.obj
  throng mesh model.ply -o pairs.npy --order canonical
  throng mesh part.stl tool.stl --picture parts.png --view 0,0,1
  throng mesh model.obj --weld --exit-code && echo clean
  throng mesh model.off --within 0.001 --json
  throng mesh --scene crumpled --triangles 100K --picture crumpled.png
Exit status: 0 done, 1 with --exit-code if there is a pair, 2 bad input or an output that cannot be
written.)";

struct Arguments {
  std::string a, b, scene, triangles, output, picture, up;
  std::uint64_t seed = 1;
  bool has_seed = false, doubles = false, weld = false, exit_code = false, json = false;
  std::optional<double> within;
  std::optional<DoubleVec3> view;  // towards the viewer
  SearchArguments search;
  std::size_t repeat = 1;
};

NamedMesh read(const std::string& path, const Arguments& arguments) {
  try {
    const auto precision =
        arguments.doubles ? meshes::Precision::float64 : meshes::Precision::float32;
    NamedMesh named{path, meshes::read_mesh(path, precision)};
    if (arguments.weld) named.merged = meshes::weld_vertices(named.mesh);
    return named;
  } catch (const std::bad_alloc&) {
    throw Failure(fmt::format("{}: out of memory", path));
  }
}

NamedMesh generate(const Arguments& arguments) {
  scenes::MeshSpec spec;
  spec.name = arguments.scene;
  spec.triangles =
      common::parse_count(arguments.triangles.empty() ? "100K" : arguments.triangles, "--triangles",
                          scenes::min_mesh_triangles, scenes::max_mesh_triangles);
  spec.seed = arguments.seed;
  scenes::GeneratedMesh made = scenes::make_mesh(spec);
  NamedMesh named;
  named.name = spec.name;
  named.mesh.vertices = std::move(made.vertices);
  named.mesh.triangles = std::move(made.triangles);
  return named;
}

void check(const Arguments& arguments) {
  if (arguments.a.empty() == arguments.scene.empty()) {
    throw Failure(arguments.a.empty() ? "found no mesh, wanted a file or --scene"
                                      : "found a file and --scene, wanted one of them");
  }
  if (!arguments.scene.empty() && arguments.doubles) {
    throw Failure("--double: found --scene, wanted a file; generated meshes are float32");
  }
  if (!arguments.scene.empty() && arguments.weld) {
    throw Failure("--weld: found --scene, wanted a file; generated meshes need none");
  }
  if (arguments.scene.empty() && (!arguments.triangles.empty() || arguments.has_seed)) {
    throw Failure("found --triangles or --seed without --scene, wanted both or a file alone");
  }
  if (!arguments.picture.empty()) return;
  if (!arguments.up.empty()) throw Failure("found --up, wanted --picture with it");
  if (arguments.view) throw Failure("found --view, wanted --picture with it");
}

// "1,0,-0.5"
DoubleVec3 parse_view(const std::string& text) {
  const std::string wanted = "three numbers X,Y,Z of at most 1e9 in size, not all 0";
  double c[3] = {};
  std::size_t begin = 0;
  for (int k = 0; k < 3; ++k) {
    const std::size_t comma = text.find(',', begin);
    if ((comma == std::string::npos) != (k == 2)) break;
    c[k] = common::parse_number(text.substr(begin, comma - begin), "--view", -1e9, 1e9, wanted);
    if (k == 2 && (c[0] != 0 || c[1] != 0 || c[2] != 0)) return {c[0], c[1], c[2]};
    begin = comma + 1;
  }
  throw Failure(fmt::format("--view: found '{}', wanted {}", text, wanted));
}

Json to_json(const MeshSearchReport& report, const Arguments& arguments, const NamedMesh& a,
             const NamedMesh* b) {
  Json json;
  const auto add_mesh = [&](const NamedMesh& mesh, const std::string& suffix) {
    json["triangles" + suffix] = mesh.mesh.triangles.size();
    json["vertices" + suffix] = mesh.mesh.vertex_count();
    json["dropped" + suffix] = mesh.mesh.dropped;
    if (arguments.weld) json["merged" + suffix] = mesh.merged;
  };
  add_mesh(a, "");
  if (b != nullptr) add_mesh(*b, "_b");
  json["precision"] = arguments.doubles ? "float64" : "float32";
  if (arguments.within) json["within"] = *arguments.within;
  json["pairs"] = report.pairs;
  json["checksum"] = hex(report.checksum);
  json["kinds"] = {
      {"crossing", report.crossing}, {"touching", report.touching}, {"coplanar", report.coplanar}};
  if (arguments.within) json["kinds"]["apart"] = report.apart;
  json["triangles_in_pairs"] = report.marked_triangles_a;
  if (b != nullptr) json["triangles_in_pairs_b"] = report.marked_triangles_b;
  json["candidates"] = report.candidates;
  json["exact_tests"] = report.exact_tests;
  add_plan_and_times(json, report.plan, report.total_ms, report.first_ms, report.stages);
  json["kinds_ms"] = report.kinds_ms;
  json["peak_bytes"] = report.peak_bytes ? Json(*report.peak_bytes) : Json(nullptr);
  return json;
}

// "1 pair", "2 pairs"
std::string counted(std::uint64_t count, const char* one, const char* many) {
  return fmt::format("{} {}", report::format_count(count), count == 1 ? one : many);
}
std::string triangle_count(std::uint64_t count) { return counted(count, "triangle", "triangles"); }

std::string mesh_text(const NamedMesh& mesh) {
  std::string text =
      fmt::format("{}: {}, {}", mesh.name, triangle_count(mesh.mesh.triangles.size()),
                  counted(mesh.mesh.vertex_count(), "vertex", "vertices"));
  if (mesh.merged != 0) text += fmt::format("; {} merged", report::format_count(mesh.merged));
  if (mesh.mesh.dropped != 0) {
    text += fmt::format("; {} dropped (a repeated index, or fewer than 3 vertices)",
                        report::format_count(mesh.mesh.dropped));
  }
  return text + "\n";
}

// Vertices of a file with a position in common make neighbours touch: a frequent reason for pairs
// of one mesh.
std::string weld_hint(const MeshSearchReport& report, const Arguments& arguments,
                      const NamedMesh& a, const NamedMesh* b) {
  if (report.pairs == 0 || b != nullptr || arguments.weld || !arguments.scene.empty()) return "";
  meshes::MeshFile copy = a.mesh;
  const std::size_t merged = meshes::weld_vertices(copy);
  if (merged == 0) return "";
  return fmt::format("hint      {} the position of another one; --weld makes them one\n",
                     counted(merged, "vertex has", "vertices have"));
}

std::string to_text(const MeshSearchReport& report, const Arguments& arguments, const NamedMesh& a,
                    const NamedMesh* b) {
  std::string text = mesh_text(a);
  if (b != nullptr) text += mesh_text(*b);
  text += fmt::format("pairs     {}", report::format_count(report.pairs));
  if (arguments.within) text += fmt::format(" at most {:g} apart", *arguments.within);
  text += fmt::format("  ({} of {}", report::format_count(report.marked_triangles_a),
                      triangle_count(a.mesh.triangles.size()));
  if (b != nullptr) {
    text += fmt::format(" with {} of {}", report::format_count(report.marked_triangles_b),
                        report::format_count(b->mesh.triangles.size()));
  }
  text += fmt::format(")\nchecksum  {}\nkinds     {} crossing, {} touching, {} coplanar",
                      hex(report.checksum), report::format_count(report.crossing),
                      report::format_count(report.touching), report::format_count(report.coplanar));
  if (arguments.within) text += fmt::format(", {} apart", report::format_count(report.apart));
  text += "\n" + weld_hint(report, arguments, a, b);
  text += fmt::format("tested    {}, {} of them by exact arithmetic\n",
                      counted(report.candidates, "candidate", "candidates"),
                      report::format_count(report.exact_tests));
  text += fmt::format("plan      {}, {}, {} thread{}\n", to_string(report.plan.algorithm),
                      to_string(report.plan.isa), report.plan.threads,
                      report.plan.threads == 1 ? "" : "s");
  text += fmt::format("time      {}  (median of {} warmed run{}; the first call took {})\n",
                      milliseconds(report.total_ms), arguments.repeat,
                      arguments.repeat == 1 ? "" : "s", milliseconds(report.first_ms));
  text +=
      fmt::format("  plan    {}\n  bin     {}\n  find    {}\n", milliseconds(report.stages.plan_ms),
                  milliseconds(report.stages.bin_ms), milliseconds(report.stages.find_ms));
  if (arguments.search.order == "canonical") {
    text += fmt::format("  order   {}\n", milliseconds(report.stages.order_ms));
  }
  text += fmt::format("kinds took {}\n", milliseconds(report.kinds_ms));
  if (report.peak_bytes) {
    text += fmt::format("memory    {} at most\n",
                        report::format_bytes(static_cast<double>(*report.peak_bytes)));
  }
  if (!arguments.output.empty()) text += fmt::format("pairs are in {}\n", arguments.output);
  if (!arguments.picture.empty()) text += fmt::format("picture is in {}\n", arguments.picture);
  return text;
}

// Scenes and the STL files of printers have z up; models have y up by custom.
report::UpAxis up_axis(const Arguments& arguments) {
  if (arguments.up == "x") return report::UpAxis::x;
  if (arguments.up == "y") return report::UpAxis::y;
  if (arguments.up == "z" || !arguments.scene.empty()) return report::UpAxis::z;
  const std::size_t dot = arguments.a.rfind('.');
  const std::string suffix = dot == std::string::npos ? "" : arguments.a.substr(dot);
  return suffix == ".stl" || suffix == ".STL" ? report::UpAxis::z : report::UpAxis::y;
}

// The name without its folders.
std::string short_name(const std::string& name) {
  return name.substr(name.find_last_of("/\\") + 1);
}

void draw(const MeshSearchReport& report, const Arguments& arguments, const NamedMesh& a,
          const NamedMesh* b) {
  report::PictureStyle style;
  style.dark = false;
  style.title = short_name(a.name);
  std::size_t triangles = a.mesh.triangles.size();
  std::vector<report::MeshPart> parts = {{a.mesh.view(), report.marked_a.data(), ""}};
  if (b != nullptr) {
    style.title += " and " + short_name(b->name);
    triangles += b->mesh.triangles.size();
    parts[0].name = short_name(a.name);
    parts.push_back({b->mesh.view(), report.marked_b.data(), short_name(b->name)});
  }
  const std::string relation = arguments.within
                                   ? fmt::format("at most {:g} apart", *arguments.within)
                               : report.pairs == 1 ? "that intersects"
                                                   : "that intersect";
  style.caption =
      fmt::format("{}, {} {}, {}", triangle_count(triangles),
                  counted(report.pairs, "pair", "pairs"), relation, milliseconds(report.total_ms));
  const report::UpAxis up = up_axis(arguments);
  if (arguments.view) report::look_from(*arguments.view, up, style);
  const std::string marked =
      fmt::format("{} of {}", triangle_count(report.marked_triangles_a + report.marked_triangles_b),
                  report.pairs == 1 ? "this pair" : "these pairs");
  report::draw_meshes(arguments.picture, parts, marked, up, style);
}

int run(const Arguments& arguments) {
  check(arguments);
  scenes::check_outputs({{"-o", arguments.output}, {"--picture", arguments.picture}},
                        {{"A", arguments.a}, {"B", arguments.b}});
  report::check_png(arguments.picture);
  MeshSearchRequest request;
  request.options = to_options({}, arguments.search);
  request.hint_options = {.backend = true,
                          .isa = arguments.search.isa == "auto" ? "" : arguments.search.isa};
  request.within = arguments.within;
  request.repeat = arguments.repeat;
  request.output = arguments.output;
  request.marks = !arguments.picture.empty();
  const NamedMesh a = arguments.scene.empty() ? read(arguments.a, arguments) : generate(arguments);
  std::optional<NamedMesh> b;
  if (!arguments.b.empty()) b = read(arguments.b, arguments);
  const NamedMesh* const second = b ? &*b : nullptr;
  const MeshSearchReport report = run_mesh_search(a, second, request);
  if (request.marks) draw(report, arguments, a, second);
  print(arguments.json ? to_json(report, arguments, a, second).dump(2) + "\n"
                       : to_text(report, arguments, a, second));
  return arguments.exit_code && report.pairs != 0 ? exit_differs : exit_done;
}

}  // namespace

Run add_mesh(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app =
      *program.add_subcommand("mesh", "Find the triangles of meshes that intersect, exactly");
  app.footer(help_text);
  app.add_option("A", arguments->a, "a triangle mesh: .obj, .off, .ply or .stl")->type_name("FILE");
  app.add_option("B", arguments->b, "a second mesh: pairs of a triangle of A and one of B")
      ->type_name("FILE");
  app.add_option_function<std::string>(
         "--within",
         [arguments](const std::string& text) {
           arguments->within = common::parse_number(
               text, "--within", 0, std::numeric_limits<double>::max(), "0 to 1.7e308");
         },
         "pairs at most this far apart; in one mesh without neighbours")
      ->type_name("D");
  app.add_flag("--double", arguments->doubles, "keep coordinates as double, not float32");
  app.add_flag("--weld", arguments->weld,
               "vertices at equal positions of a file become one, so that their triangles are "
               "neighbours");
  add_search_arguments(app, arguments->search, AutoBackend::cpu);
  app.add_option("-o,--output", arguments->output, "write the pairs: uint32 of shape (pairs, 2)")
      ->type_name("PAIRS.npy");
  app.add_option("--picture", arguments->picture,
                 "draw the meshes, triangles of pairs in red; hidden ones shine through")
      ->type_name("PICTURE.png");
  app.add_option_function<std::string>(
         "--view", [arguments](const std::string& text) { arguments->view = parse_view(text); },
         "where the viewer of the picture stands, as a direction from the mesh: 0,0,1 looks down z")
      ->type_name("X,Y,Z");
  app.add_option("--up", arguments->up,
                 "the axis that points up in the picture; y, but z for .stl and scenes")
      ->check(CLI::IsMember({"x", "y", "z"}).description(""))
      ->type_name("x|y|z");
  app.add_option_function<std::string>(
         "--repeat", common::count_into(arguments->repeat, "--repeat", 1, 1000000),
         "number of warmed runs for the median (1)")
      ->type_name("K");
  std::string list;
  for (const std::string& name : scenes::mesh_names()) list += (list.empty() ? "" : "|") + name;
  app.add_option("--scene", arguments->scene, "a generated mesh instead of a file: " + list)
      ->check(CLI::IsMember(scenes::mesh_names()).description(""))
      ->type_name("NAME");
  app.add_option("--triangles", arguments->triangles, "at most so many in a generated mesh (100K)")
      ->type_name("N");
  app.add_option_function<std::string>(
         "--seed",
         [arguments](const std::string& text) {
           arguments->seed = common::parse_seed(text, "--seed");
           arguments->has_seed = true;
         },
         "random seed of a generated mesh (1)")
      ->type_name("S");
  app.add_flag("--exit-code", arguments->exit_code,
               "exit with status 1 if there is a pair, else 0");
  app.add_flag("--json", arguments->json, "print one JSON object");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
