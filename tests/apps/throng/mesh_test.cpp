// throng mesh: its output, text and files; refused meshes and options.
#include <throng/checksum.hpp>

#include "apps/report/write_png.hpp"
#include "support/sanitized.hpp"
#include "tests/apps/throng/cli_test.hpp"

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace throng::test {
namespace {

// Triangles 0 and 1 share an edge, through which 2 passes; 3 touches 2 at a corner; 4 lies in the
// plane of 3 and overlaps it; 5 is far away.
const char* const crossing_obj =
    "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n"
    "f 1 2 3 4\n"
    "v 1 1 -1\nv 3 3 -1\nv 2 2 5\n"
    "f 5 6 7\n"
    "v 2 2 5\nv 3 2 7\nv 1 2 7\nf 8 9 10\n"
    "v 2 2 6\nv 3 2 8\nv 1 2 8\nf 11 12 13\n"
    "v 90 0 0\nv 91 0 0\nv 90 1 0\nf 14 15 16\nf 14 15 15\n";

class Mesh : public CliTest {
 protected:
  static std::string checksum(const std::vector<Pair>& pairs) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx",
                  static_cast<unsigned long long>(pair_checksum(pairs.data(), pairs.size())));
    return text;
  }

  // The pairs of a file of `count` pairs.
  std::vector<Pair> read_pairs(const std::string& name, std::size_t count) const {
    const std::string bytes = slurp(at(name));
    EXPECT_GE(bytes.size(), 10u + 8 * count);
    std::vector<Pair> pairs(count);
    if (bytes.size() < 8 * count || count == 0) return pairs;
    EXPECT_NE(bytes.find("(" + std::to_string(count) + ", 2)"), std::string::npos);
    std::memcpy(pairs.data(), bytes.data() + bytes.size() - 8 * count, 8 * count);
    return pairs;
  }
};

TEST_F(Mesh, json_has_all_fields) {
  spill(at("a.obj"), crossing_obj);
  const auto j = json({"mesh", at("a.obj"), "--threads", "1", "--repeat", "3"});
  EXPECT_EQ(j.at("triangles"), 6);
  EXPECT_EQ(j.at("vertices"), 16);
  EXPECT_EQ(j.at("dropped"), 1);
  EXPECT_EQ(j.at("precision"), "float32");
  EXPECT_EQ(j.at("pairs"), 4);
  EXPECT_EQ(j.at("checksum"), checksum({{0, 2}, {1, 2}, {2, 3}, {3, 4}}));
  EXPECT_EQ(j.at("kinds"), nlohmann::json({{"crossing", 0}, {"touching", 3}, {"coplanar", 1}}));
  EXPECT_EQ(j.at("triangles_in_pairs"), 5);
  EXPECT_GE(j.at("candidates").get<std::uint64_t>(), 5u);
  EXPECT_TRUE(j.at("exact_tests").is_number_unsigned());
  EXPECT_EQ(j.at("backend"), "cpu");
  EXPECT_EQ(j.at("threads"), 1);
  EXPECT_TRUE(j.at("algorithm").is_string());
  EXPECT_TRUE(j.at("isa").is_string());
  EXPECT_GE(j.at("total_ms").get<double>(), 0);
  EXPECT_GT(j.at("first_ms").get<double>(), 0);
  EXPECT_GE(j.at("kinds_ms").get<double>(), 0);
  EXPECT_TRUE(j.at("stages_ms").contains("find"));
  EXPECT_TRUE(j.at("peak_bytes").is_number_unsigned());
  EXPECT_FALSE(j.contains("within"));
  EXPECT_FALSE(j.contains("triangles_b"));
}

TEST_F(Mesh, text_output_agrees_with_json) {
  spill(at("a.obj"), crossing_obj);
  const ProcessOutput output = run({"mesh", at("a.obj"), "--order", "canonical"});
  EXPECT_EQ(output.status, 0) << output.err;
  EXPECT_EQ(output.err, "");
  for (const std::string& word :
       {std::string("6 triangles, 16 vertices; 1 dropped"), std::string("5 of 6 triangles"),
        checksum({{0, 2}, {1, 2}, {2, 3}, {3, 4}}),
        std::string("0 crossing, 3 touching, 1 coplanar"), std::string("candidates")}) {
    EXPECT_NE(output.out.find(word), std::string::npos) << word << " in " << output.out;
  }
}

TEST_F(Mesh, pairs_are_written_and_sorted) {
  const auto j = json(
      {"mesh", "--scene", "knot", "--triangles", "5K", "--order", "canonical", "-o", at("p.npy")});
  const std::vector<Pair> pairs = read_pairs("p.npy", j.at("pairs").get<std::size_t>());
  ASSERT_GT(pairs.size(), 1000u);
  EXPECT_EQ(j.at("checksum"), checksum(pairs));
  for (std::size_t k = 1; k < pairs.size(); ++k) ASSERT_LT(pairs[k - 1], pairs[k]);
  const auto kinds = j.at("kinds");
  EXPECT_EQ(kinds.at("crossing").get<std::size_t>() + kinds.at("touching").get<std::size_t>() +
                kinds.at("coplanar").get<std::size_t>(),
            pairs.size());
}

TEST_F(Mesh, the_emulated_device_has_the_same_pairs) {
  const auto of = [this](const char* backend) {
    return json({"mesh", "--scene", "crumpled", "--triangles", "5K", "--backend", backend});
  };
  const auto cpu = of("cpu"), emulated = of("emulated");
  EXPECT_EQ(emulated.at("backend"), "emulated");
  ASSERT_GT(cpu.at("pairs").get<std::size_t>(), 0u);
  for (const char* key : {"pairs", "checksum", "kinds", "candidates"})
    EXPECT_EQ(emulated.at(key), cpu.at(key)) << key;
  const ProcessOutput within =
      run({"mesh", "--scene", "crumpled", "--backend", "emulated", "--within", "1"});
  EXPECT_EQ(within.status, 2);
  EXPECT_NE(within.err.find("triangles within a distance are searched on the CPU alone"),
            std::string::npos)
      << within.err;
}

TEST_F(Mesh, two_meshes) {
  spill(at("a.obj"), "v 0 0 0\nv 4 0 0\nv 0 4 0\nf 1 2 3\nv 0 0 9\nv 4 0 9\nv 0 4 9\nf 4 5 6\n");
  spill(at("b.off"), "OFF\n3 1 0\n1 1 -1\n2 1 -1\n1 2 2\n3 0 1 2\n");
  const auto j = json({"mesh", at("a.obj"), at("b.off")});
  EXPECT_EQ(j.at("triangles"), 2);
  EXPECT_EQ(j.at("triangles_b"), 1);
  EXPECT_EQ(j.at("vertices_b"), 3);
  EXPECT_EQ(j.at("dropped_b"), 0);
  EXPECT_EQ(j.at("checksum"), checksum({{0, 0}}));
  EXPECT_EQ(j.at("kinds").at("crossing"), 1);
  EXPECT_EQ(j.at("triangles_in_pairs"), 1);
  EXPECT_EQ(j.at("triangles_in_pairs_b"), 1);
  const auto far = json({"mesh", at("a.obj"), at("b.off"), "--within", "7"});
  EXPECT_EQ(far.at("within"), 7.0);
  EXPECT_EQ(far.at("checksum"), checksum({{0, 0}, {1, 0}}));
  EXPECT_EQ(far.at("kinds").at("apart"), 1);
  EXPECT_EQ(json({"mesh", at("a.obj"), at("b.off"), "--within", "6.999"}).at("pairs"), 1);
  const ProcessOutput text = run({"mesh", at("a.obj"), at("b.off"), "--within", "7"});
  EXPECT_NE(text.out.find("2 at most 7 apart"), std::string::npos) << text.out;
}

TEST_F(Mesh, doubles_are_kept_on_request) {
  // The second triangle is 2^-40 above the first: one plane in float32.
  spill(at("a.obj"),
        "v 1 0 0\nv 2 0 0\nv 1 1 0\nf 1 2 3\n"
        "v 1 0 1\nv 2 0 1\nv 1 1 1.0000000000009094947017729282379150390625\nf 4 5 6\n"
        "v 1 0 1\nv 2 0 1\nv 1 1 1\nf 7 8 9\n");
  EXPECT_EQ(json({"mesh", at("a.obj")}).at("kinds").at("coplanar"), 1);
  const auto j = json({"mesh", at("a.obj"), "--double"});
  EXPECT_EQ(j.at("precision"), "float64");
  EXPECT_EQ(j.at("pairs"), 1);
  EXPECT_EQ(j.at("kinds").at("touching"), 1);
}

TEST_F(Mesh, formats_with_the_same_mesh_have_the_same_pairs) {
  const std::string corners[6] = {"0 0 0", "4 0 0", "0 4 0", "1 1 -1", "2 1 -1", "1 2 2"};
  std::string obj, off = "OFF\n6 2 0\n", stl = "solid\n";
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 6; ++i) {
    obj += "v " + corners[i] + "\n";
    off += corners[i] + "\n";
    ply += corners[i] + "\n";
    if (i % 3 == 0) stl += "facet normal 0 0 0\nouter loop\n";
    stl += "vertex " + corners[i] + "\n";
    if (i % 3 == 2) stl += "endloop\nendfacet\n";
  }
  spill(at("a.obj"), obj + "f 1 2 3\nf 4 5 6\n");
  spill(at("a.off"), off + "3 0 1 2\n3 3 4 5\n");
  spill(at("a.ply"), ply + "3 0 1 2\n3 3 4 5\n");
  spill(at("a.stl"), stl + "endsolid\n");
  for (const char* name : {"a.obj", "a.off", "a.ply", "a.stl"}) {
    const auto j = json({"mesh", at(name)});
    EXPECT_EQ(j.at("checksum"), checksum({{0, 1}})) << name;
    EXPECT_EQ(j.at("vertices"), 6) << name;
  }
}

TEST_F(Mesh, pictures_are_written) {
  spill(at("a.obj"), crossing_obj);
  // Huge and unused coordinates are drawn, too.
  spill(at("b.obj"), "v 1e300 0 0\nv 0 1e300 0\nv 0 0 -1e300\nv nan 0 0\nf 1 2 3\n");
  const std::vector<std::string> draw = {"mesh",      at("a.obj"), at("b.obj"), "--double",
                                         "--up",      "x",         "--view",    "-1,0.5,0",
                                         "--picture", at("a.png")};
  if (!report::can_write_png()) {
    refuses(draw, {"a.png", "this build has no Cairo"});
    return;
  }
  const ProcessOutput output = run(draw);
  EXPECT_EQ(output.status, 0) << output.err;
  EXPECT_NE(output.out.find("picture is in "), std::string::npos) << output.out;
  EXPECT_EQ(slurp(at("a.png")).substr(1, 3), "PNG");
}

// Two triangles with an edge in common by position alone.
const char* const split_obj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 0 1 0\nv 1 0 0\nv 1 1 0\nf 4 5 6\n";

TEST_F(Mesh, weld_makes_triangles_neighbours) {
  spill(at("a.obj"), split_obj);
  const auto apart = json({"mesh", at("a.obj")});
  EXPECT_EQ(apart.at("pairs"), 1);
  EXPECT_FALSE(apart.contains("merged"));
  const auto welded = json({"mesh", at("a.obj"), "--weld"});
  EXPECT_EQ(welded.at("pairs"), 0);
  EXPECT_EQ(welded.at("vertices"), 4);
  EXPECT_EQ(welded.at("merged"), 2);
  // Each mesh by itself.
  const auto two = json({"mesh", at("a.obj"), at("a.obj"), "--weld", "--double"});
  EXPECT_EQ(two.at("pairs"), 4);
  EXPECT_EQ(two.at("merged_b"), 2);
  EXPECT_NE(run({"mesh", at("a.obj"), "--weld"}).out.find("2 triangles, 4 vertices; 2 merged\n"),
            std::string::npos);
}

TEST_F(Mesh, text_names_weld_where_it_would_matter) {
  spill(at("a.obj"), split_obj);
  const std::string hint =
      "hint      2 vertices have the position of another one; --weld makes them one\n";
  EXPECT_NE(run({"mesh", at("a.obj")}).out.find(hint), std::string::npos);
  EXPECT_EQ(run({"mesh", at("a.obj"), "--weld"}).out.find("hint"), std::string::npos);
  EXPECT_EQ(run({"mesh", at("a.obj"), at("a.obj")}).out.find("hint"), std::string::npos);
}

TEST_F(Mesh, exit_code_says_whether_there_is_a_pair) {
  spill(at("a.obj"), split_obj);
  EXPECT_EQ(run({"mesh", at("a.obj")}).status, 0);
  const ProcessOutput found = run({"mesh", at("a.obj"), "--exit-code"});
  EXPECT_EQ(found.status, 1);
  EXPECT_EQ(found.err, "");
  EXPECT_NE(found.out.find("pairs     1  (2 of 2 triangles)"), std::string::npos) << found.out;
  EXPECT_EQ(run({"mesh", at("a.obj"), "--weld", "--exit-code"}).status, 0);
  EXPECT_EQ(run({"mesh", at("a.obj"), "--weld", "--exit-code", "--json"}).status, 0);
  EXPECT_EQ(run({"mesh", at("none.obj"), "--exit-code"}).status, 2);
}

TEST_F(Mesh, help_says_what_auto_is) {
  const std::string help = run({"mesh", "--help"}).out;
  EXPECT_NE(help.find("auto: the CPU; cuda: a GPU"), std::string::npos) << help;
  EXPECT_EQ(help.find("where it is faster"), std::string::npos) << help;
  EXPECT_EQ(json({"mesh", "--scene", "sphere", "--backend", "auto"}).at("backend"), "cpu");
}

TEST_F(Mesh, counts_of_one_are_singular) {
  spill(at("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const std::string out = run({"mesh", at("a.obj")}).out;
  EXPECT_NE(out.find("1 triangle, 3 vertices\n"), std::string::npos) << out;
  EXPECT_NE(out.find("(0 of 1 triangle)"), std::string::npos) << out;
}

TEST_F(Mesh, refuses_broken_files) {
  refuses({"mesh", at("none.obj")}, {"none.obj: found no file"});
  refuses({"mesh", folder_.string() + ".obj"}, {".obj"});
  spill(at("a.gltf"), "{}");
  refuses({"mesh", at("a.gltf")}, {"a.gltf", "'.gltf'", ".obj, .off, .ply or .stl"});
  for (const char* name : {"e.obj", "e.off", "e.ply", "e.stl"}) {
    spill(at(name), "");
    refuses({"mesh", at(name)}, {name, "an empty file"});
  }
  spill(at("v.obj"), "f 1 2 3\n");
  refuses({"mesh", at("v.obj")}, {"v.obj", "no vertices"});
  spill(at("i.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  refuses({"mesh", at("i.obj")}, {"i.obj, line 4", "index 4", "1 to 3"});
  spill(at("good.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  refuses({"mesh", at("good.obj"), at("i.obj")}, {"i.obj, line 4"});
}

TEST_F(Mesh, refuses_vertices_that_are_not_finite) {
  spill(at("n.obj"), "v 0 0 0\nv 1 nan 0\nv 0 1 0\nv inf 0 0\nf 1 3 3\nf 1 2 3\n");
  refuses({"mesh", at("n.obj")}, {"n.obj: ", "vertex 1", "triangle 0"});
  // Unused ones may be anything.
  spill(at("u.obj"), "v 0 0 0\nv nan inf -inf\nv 0 1 0\nv 1 0 0\nf 1 3 4\n");
  EXPECT_EQ(json({"mesh", at("u.obj")}).at("pairs"), 0);
}

TEST_F(Mesh, headers_that_claim_much_take_no_memory) {
  Limits limits;
#if !THRONG_SANITIZED  // which itself takes terabytes of address space
  limits.address_space = std::uint64_t{2} << 30;
#endif
  std::string stl(80, ' ');
  stl += std::string("\xff\xff\xff\xf0", 4) + std::string(50, '\0');
  spill(at("c.stl"), stl);
  refuses({"mesh", at("c.stl")}, {"c.stl, byte 80", "4043309055 triangles", "134 bytes"}, limits);
  const std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n"
      "property float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  spill(at("c.ply"), ply + std::string(24, '\0'));
  refuses({"mesh", at("c.ply")}, {"c.ply, byte 178", "4000000000 elements 'vertex'"}, limits);
  spill(at("c.off"), "OFF\n4000000000 4000000000 0\n0 0 0\n");
  refuses({"mesh", at("c.off")}, {"c.off, line 4", "4000000000"}, limits);
}

TEST_F(Mesh, refuses_options) {
  spill(at("a.obj"), crossing_obj);
  refuses({"mesh"}, {"wanted a file or --scene"});
  refuses({"mesh", at("a.obj"), "--scene", "soup"}, {"found a file and --scene"});
  refuses({"mesh", "--scene", "soup", "--double"}, {"--double: found --scene"});
  refuses({"mesh", "--scene", "torus"}, {"torus", "soup"});
  refuses({"mesh", "--scene", "soup", "--triangles", "5"},
          {"--triangles: found '5', wanted 100 to "});
  refuses({"mesh", at("a.obj"), "--triangles", "5K"}, {"--triangles", "without --scene"});
  refuses({"mesh", at("a.obj"), "--seed", "5"}, {"--seed", "without --scene"});
  refuses({"mesh", at("a.obj"), "--up", "z"}, {"found --up, wanted --picture"});
  refuses({"mesh", at("a.obj"), "--view", "0,0,1"}, {"found --view, wanted --picture"});
  for (const char* view :
       {"0,0,0", "1,2", "1,2,3,4", "1,2,x", "1,,2", "nan,0,0", "1e10,0,0", "top"})
    refuses({"mesh", at("a.obj"), "--picture", at("p.png"), "--view", view},
            {"--view: found '", "wanted three numbers X,Y,Z"});
  refuses({"mesh", "--scene", "soup", "--weld"}, {"--weld: found --scene"});
  refuses({"mesh", at("a.obj"), "--repeat", "0"}, {"--repeat: found '0'"});
  for (const char* distance : {"-1", "nan", "inf", "2m"}) {
    refuses({"mesh", at("a.obj"), "--within", distance},
            {"--within: found '" + std::string(distance) + "', wanted 0 to 1.7e308\n"});
  }
  refuses({"mesh", at("a.obj"), "-o", at("a.obj")}, {"the file of A as that of -o"});
  refuses({"mesh", at("a.obj"), "--picture", at("a.obj")}, {"the file of A", "--picture"});
  refuses({"mesh", at("a.obj"), "-o", at("p"), "--picture", at("p")}, {"-o", "--picture"});
  refuses({"mesh", at("a.obj"), "--picture", at("no/p.png")}, {"no/p.png"});
  EXPECT_EQ(slurp(at("a.obj")), crossing_obj);
}

}  // namespace
}  // namespace throng::test
