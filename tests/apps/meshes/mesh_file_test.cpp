// Mesh files: vertices and triangles as the file numbers them, and refused files.
#include "apps/meshes/mesh_file.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "apps/scenes/npy.hpp"

namespace throng::meshes {
namespace {

MeshFile parse(const std::string& name, const std::string& text,
               Precision precision = Precision::float32) {
  return parse_mesh(text.data(), text.size(), name, precision);
}

// The triangles as text, "0 1 2, 0 2 3".
std::string triangles(const MeshFile& mesh) {
  std::string text;
  for (const Triangle& t : mesh.triangles) {
    if (!text.empty()) text += ", ";
    text += std::to_string(t.a) + " " + std::to_string(t.b) + " " + std::to_string(t.c);
  }
  return text;
}

// Every word stands in the message of the error, the file's name first.
void refuses(const std::string& name, const std::string& text,
             const std::vector<std::string>& words) {
  try {
    parse(name, text);
    ADD_FAILURE() << "accepted: " << text.substr(0, 200);
  } catch (const scenes::FileError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find(name), 0u) << message;
    for (const std::string& word : words) {
      EXPECT_NE(message.find(word), std::string::npos) << "no '" << word << "' in: " << message;
    }
  }
}

template <class T>
void put(std::string& bytes, T value, bool big = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes += raw[big ? sizeof(T) - 1 - i : i];
}

TEST(Obj, KeepsIndicesAndCutsPolygonsFromTheirFirstVertex) {
  const MeshFile mesh =
      parse("a.obj",
            "# comment\r\nmtllib x.mtl\r\nv 0 0 0\r\nv 1 0 0 # here\r\n"
            "v 1 1 0 0.5 0.5 0.5\r\nv 0 1 0\r\nv 0 0 0\r\n\r\nvt 0 0\r\nvn 0 0 1\r\n"
            "o part\r\ns off\r\nf 1/1/1 2//1 3/1 4\r\nf -1 -2 \\\r\n -3\r\n"
            "f 4 3 2 1 5");
  EXPECT_EQ(mesh.vertex_count(), 5u) << "the two equal ones stay two";
  EXPECT_EQ(triangles(mesh), "0 1 2, 0 2 3, 4 3 2, 3 2 1, 3 1 0, 3 0 4");
  EXPECT_EQ(mesh.dropped, 0u);
  EXPECT_EQ(mesh.vertices[2].y, 1.0f);
  EXPECT_EQ(mesh.view().size(), 6u);
}

TEST(Obj, DropsTrianglesWithARepeatedIndex) {
  const MeshFile mesh = parse("a.obj",
                              "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\nf 1 2 3\nf 1 2\n"
                              "f 1 2 3 1\n");
  EXPECT_EQ(triangles(mesh), "0 1 2, 0 1 2");
  EXPECT_EQ(mesh.dropped, 3u);
}

TEST(Obj, LinesMayEndWithCarriageReturns) {
  EXPECT_EQ(triangles(parse("a.obj", "# c\rv 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r")), "0 1 2");
}

TEST(MeshFiles, AByteOrderMarkIsSkipped) {
  const std::string mark = "\xef\xbb\xbf";
  EXPECT_EQ(triangles(parse("a.obj", mark + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")), "0 1 2");
  EXPECT_EQ(triangles(parse("a.off", mark + "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")),
            "0 1 2");
  EXPECT_EQ(
      triangles(parse("a.ply", mark + "ply\nformat ascii 1.0\nelement vertex 3\n"
                                      "property float x\nproperty float y\nproperty float z\n"
                                      "element face 1\nproperty list uchar int vertex_indices\n"
                                      "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")),
      "0 1 2");
  EXPECT_EQ(
      triangles(parse("a.stl", mark + "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\n"
                                      "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n")),
      "0 1 2");
  refuses("a.obj", mark, {"no vertices"});
  refuses("a.obj", mark + "\n\x01\n", {"line 2", "'?'"});
}

// Positions 0 and 3 are equal, and 1 and 4; 2 and 5 differ.
TEST(Weld, EqualPositionsBecomeOneVertex) {
  const std::string text =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 0\nv 1 0 0\nv 0 1 0.5\nf 1 2 3\nf 4 5 6\nf 1 4 6\n"
      "f 6 5 4\n";
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    MeshFile mesh = parse("a.obj", text, precision);
    EXPECT_EQ(weld_vertices(mesh), 2u);
    EXPECT_EQ(mesh.vertex_count(), 4u);
    EXPECT_EQ(triangles(mesh), "0 1 2, 0 1 3, 3 1 0");
    EXPECT_EQ(mesh.dropped, 1u) << "the triangle of two equal positions";
    EXPECT_EQ(mesh.view().vertices[3].z, 0.5);
    EXPECT_EQ(weld_vertices(mesh), 0u);
    EXPECT_EQ(triangles(mesh), "0 1 2, 0 1 3, 3 1 0");
  }
}

TEST(Weld, EachNanStays) {
  MeshFile mesh = parse("a.obj", "v nan 0 0\nv nan 0 0\nv inf 0 0\nv inf 0 0\nf 1 2 3\nf 1 2 4\n");
  EXPECT_EQ(weld_vertices(mesh), 1u);
  EXPECT_EQ(triangles(mesh), "0 1 2, 0 1 2");
}

TEST(Obj, FacesMayComeBeforeTheirVertices) {
  EXPECT_EQ(triangles(parse("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n")), "0 1 2");
}

TEST(Obj, RefusesWithTheLine) {
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  refuses("a.obj", three + "f 1 2 4\n", {"line 4", "vertex index 4", "1 to 3"});
  refuses("a.obj", three + "f 1 2 0\n", {"line 4", "vertex index 0"});
  refuses("a.obj", three + "f 1 2 -4\n", {"line 4", "vertex index -4", "or -1 to -3 here"});
  refuses("a.obj", "v 0 0 0\nf -1 -1 -2\n", {"line 2", "wanted 1 and up, or -1 here"});
  refuses("a.obj", "f -1 -1 -2\nv 0 0 0\n", {"line 1", "wanted 1 and up"});
  refuses("a.obj", "v 0 0 0\nf 1 1 2\n", {"line 2", "wanted 1, the only one"});
  refuses("a.obj", three + "f 1 2 99999999999\n", {"line 4", "99999999999"});
  refuses("a.obj", three + "f 1 2 99999999999999999999999\n", {"line 4", "integer"});
  refuses("a.obj", three + "f 1 2 3x\n", {"line 4", "'3x'"});
  refuses("a.obj", three + "f\n", {"line 4", "without vertices"});
  refuses("a.obj", "v 0 0\n", {"line 1", "three coordinates"});
  refuses("a.obj", "\nv 0 zero 0\n", {"line 2", "'zero'"});
  refuses("a.obj", "v 1e39 0 0\n", {"line 1", "float32", "--double"});
  refuses("a.obj", "# nothing\n", {"no vertices"});
  refuses("a.obj",
          std::string("\x7f"
                      "ELF\x01\x02\0\0",
                      8),
          {"line 1"});
  refuses("a.obj", "", {"empty"});
}

TEST(Numbers, AreRoundedToTheNearest) {
  const std::string text =
      "v 0.1 +1.17549435e-38 0.00000000000000000000000012345678\n"
      "v 3.4028234663852886e38 1e-45 16777217\nv -1e-400 nan -inf\nf 1 2 3";
  const MeshFile floats = parse("a.obj", text);
  EXPECT_EQ(floats.vertices[0].x, 0.1f);
  EXPECT_EQ(floats.vertices[0].y, 1.17549435e-38f);
  EXPECT_EQ(floats.vertices[0].z, 0.00000000000000000000000012345678f);
  EXPECT_EQ(floats.vertices[1].x, 3.4028234663852886e38f);
  EXPECT_EQ(floats.vertices[1].y, 1e-45f);
  EXPECT_EQ(floats.vertices[1].z, 16777216.0f);
  EXPECT_EQ(floats.vertices[2].x, 0.0f);
  EXPECT_TRUE(std::isnan(floats.vertices[2].y));
  EXPECT_EQ(floats.vertices[2].z, -INFINITY);
  const MeshFile doubles = parse("a.obj", text + "\nv 1e300 0.1 5e-324\n", Precision::float64);
  EXPECT_TRUE(doubles.vertices.empty());
  EXPECT_EQ(doubles.vertex_count(), 4u);
  EXPECT_EQ(doubles.double_vertices[3].x, 1e300);
  EXPECT_EQ(doubles.double_vertices[3].y, 0.1);
  EXPECT_EQ(doubles.double_vertices[3].z, 5e-324);
  EXPECT_FALSE(doubles.view().vertices.is_float());
}

TEST(Off, KeepsIndicesAndSkipsColours) {
  const char* body =
      "\n# comment\n0 0 0 9 9\n1 0 0\n\n1 1 0 # here\n0 1 0\n4 0 1 2 3 255 0 0\n3 0 2 1\n2 0 1\n";
  for (const std::string head : {"OFF\n4 3 0", "OFF 4 3", "COFF\n4 3 0", "OFF4 3 0"}) {
    const MeshFile mesh = parse("a.off", head + body);
    EXPECT_EQ(triangles(mesh), "0 1 2, 0 2 3, 0 2 1") << head;
    EXPECT_EQ(mesh.vertex_count(), 4u);
    EXPECT_EQ(mesh.dropped, 1u);
  }
}

TEST(Off, Refuses) {
  const std::string good = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(triangles(parse("a.off", good)), "0 1 2");
  refuses("a.off", "GIF\n", {"line 1", "'GIF'", "OFF"});
  refuses("a.off", "OFF BINARY\n", {"binary", "PLY"});
  refuses("a.off", "OFF\n3 -1 0\n", {"line 2", "'-1'"});
  refuses("a.off", "OFF\n4000000000 1 0\n0 0 0\n", {"after 1 vertices", "4000000000"});
  refuses("a.off", "OFF\n1 4000000000 0\n0 0 0\n", {"after 0 faces", "4000000000"});
  refuses("a.off", "OFF\n1 1 0\n0 0 0\n4000000000 0 0 0\n", {"the end of the file"});
  refuses("a.off", good + "3 0 1 2\n", {"line 7", "after the last face"});
  refuses("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", {"line 6", "index 3", "0 to 2"});
  refuses("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n", {"line 6", "'-2'"});
  refuses("a.off", "OFF\n3 1 0\n0 0\n1 0 0\n", {"line 3", "three coordinates"});
  for (std::size_t size = 0; size + 2 < good.size(); ++size) {
    refuses("a.off", good.substr(0, size), {});
  }
}

// Four vertices and a quadrilateral, a triangle with flags, and a strip, in any encoding.
std::string ply(const std::string& format) {
  std::string file =
      "ply\nformat " + format +
      " 1.0\ncomment a comment\nelement vertex 4\nproperty double z\n"
      "property uchar red\nproperty float x\nproperty short y\n"
      "element noise 2\nproperty list ushort float values\n"
      "element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  const double z[4] = {0.5, 0.1, 0, 0};
  const float x[4] = {0, 1, 1, 0};
  const std::int16_t y[4] = {0, 0, 1, -1};
  const std::vector<std::vector<int>> faces = {{0, 1, 2, 3}, {3, 2, 1}};
  const std::vector<int> strip = {0, 1, 2, 3, -1, 3, 2, 0};
  if (format == "ascii") {
    for (int i = 0; i < 4; ++i) {
      file += (i == 0   ? "0.5"
               : i == 1 ? "0.1"
                        : "0") +
              std::string(" 255 ") + std::to_string(int(x[i])) + " " + std::to_string(y[i]) + "\n";
    }
    return file + "2 1.5 2.5\n0\n7 4 0 1 2 3\n7 3 3 2 1\n8 0 1 2 3 -1 3 2 0\n";
  }
  const bool big = format == "binary_big_endian";
  for (int i = 0; i < 4; ++i) {
    put(file, z[i], big);
    file += '\xff';
    put(file, x[i], big);
    put(file, y[i], big);
  }
  put(file, std::uint16_t{2}, big);
  put(file, 1.5f, big);
  put(file, 2.5f, big);
  put(file, std::uint16_t{0}, big);
  for (const std::vector<int>& face : faces) {
    file += '\x07';
    file += static_cast<char>(face.size());
    for (const int corner : face) put(file, corner, big);
  }
  put(file, static_cast<int>(strip.size()), big);
  for (const int corner : strip) put(file, corner, big);
  return file;
}

TEST(Ply, AllEncodingsAreTheSame) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const MeshFile mesh = parse("a.PLY", ply(format));
    EXPECT_EQ(triangles(mesh), "0 1 2, 0 2 3, 3 2 1, 0 1 2, 2 1 3, 3 2 0") << format;
    ASSERT_EQ(mesh.vertex_count(), 4u) << format;
    EXPECT_EQ(mesh.vertices[0].z, 0.5f);
    EXPECT_EQ(mesh.vertices[1].z, 0.1f);
    EXPECT_EQ(mesh.vertices[1].x, 1.0f);
    EXPECT_EQ(mesh.vertices[3].y, -1.0f);
    EXPECT_EQ(parse("a.ply", ply(format), Precision::float64).double_vertices[1].z, 0.1) << format;
  }
}

TEST(Ply, RefusesEveryTruncation) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string good = ply(format);
    // The last number of the ASCII file has one digit, and its line end may be missing.
    for (std::size_t size = 1; size + 2 < good.size(); ++size) {
      refuses("a.ply", good.substr(0, size), {});
    }
    refuses("a.ply", good + "1", {"more than the header"});
  }
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Ply, RefusesHeadersThatClaimMoreThanTheFile) {
  for (const char* format : {"ascii", "binary_little_endian"}) {
    for (const char* element : {"vertex 4", "noise 2", "face 2", "tristrips 1"}) {
      const std::string name = std::string(element).substr(0, std::string(element).find(' '));
      refuses("a.ply", replaced(ply(format), element, name + " 4000000000000"),
              {"4000000000000", name});
      refuses("a.ply", replaced(ply(format), element, name + " -1"), {"'-1'"});
    }
  }
  // An element without properties takes no time, whatever its number.
  const std::string empty = "element hollow 9000000000000000000\nelement vertex 4";
  EXPECT_EQ(parse("a.ply", replaced(ply("ascii"), "element vertex 4", empty)).vertex_count(), 4u);
  // A list longer than the file.
  std::string text = replaced(ply("ascii"), "4 0 1 2 3", "4000000000 0 1 2 3");
  refuses("a.ply", text, {"line 23", "length 4000000000"});
  refuses("a.ply", replaced(ply("ascii"), "4 0 1 2 3", "-4 0 1 2 3"), {"length -4"});
}

TEST(Ply, RefusesOtherErrorsWithTheLine) {
  const std::string good = ply("ascii");
  refuses("a.ply", replaced(good, "7 3 3 2 1", "7 3 3 2 4"), {"line 24", "index 4", "0 to 3"});
  refuses("a.ply", replaced(good, "7 3 3 2 1", "7 3 3 2 -1"), {"line 24", "index -1"});
  refuses("a.ply", replaced(good, "7 3 3 2 1", "7 3 3 2 1.5"), {"line 24", "'1.5'"});
  refuses("a.ply", replaced(good, "0.1 255", "0.1.1 255"), {"line 18", "'0.1.1'"});
  refuses("a.ply", replaced(good, "format ascii 1.0", "format ascii 2.0"), {"line 2", "'2.0'"});
  refuses("a.ply", replaced(good, "format ascii", "format zip"), {"line 2", "'zip'", "ascii"});
  refuses("a.ply", replaced(good, "property short y", "property half y"), {"line 8", "'half'"});
  refuses("a.ply", replaced(good, "property short y", "property short v"), {"x, y and z"});
  refuses("a.ply", replaced(good, "list uchar int", "list float int"), {"float as its length"});
  refuses("a.ply", replaced(good, "list uchar int", "list uchar float"), {"floats"});
  refuses("a.ply", replaced(good, "vertex_indices", "corners"), {"'face'", "vertex_indices"});
  refuses("a.ply", replaced(good, "format ascii 1.0\n", ""), {"format"});
  refuses("a.ply", "plx\n", {"line 1", "'plx'"});
  std::string endless = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 2000; ++i) endless += "element e 0\n";
  refuses("a.ply", endless + "end_header\n", {"1000"});
}

std::string binary_stl(const std::vector<float>& corners, std::uint32_t count) {
  std::string file = "solid by an exporter that writes so";
  file.resize(80, '\0');
  put(file, count);
  for (std::size_t i = 0; i < corners.size(); i += 9) {
    file.append(12, '\0');
    for (std::size_t k = 0; k < 9; ++k) put(file, corners[i + k]);
    file.append(2, '\0');
  }
  return file;
}

TEST(Stl, EqualPositionsAreOneVertexByFirstUse) {
  const std::string text =
      "solid a name\n facet normal 0 0 nan\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
      "   vertex 0 1 0\n  endloop\n endfacet\n FACET NORMAL 0 0 1\n  outer loop\n"
      "   vertex 1 0 -0\n   vertex 1 1 0\n   vertex 0 1e0 0\n  endloop\n endfacet\n"
      "endsolid a name\nsolid b\nfacet normal 0 0 0\nouter loop\nvertex 1 1 0\nvertex 1 1 0\n"
      "vertex 5 5 5\nendloop\nendfacet\nendsolid b\n";
  const MeshFile ascii = parse("a.stl", text);
  const MeshFile binary =
      parse("b.STL", binary_stl({0, 0, 0,     1, 0, 0, 0, 1, 0,  //
                                 1, 0, -0.0f, 1, 1, 0, 0, 1, 0, 1, 1, 0, 1, 1, 0, 5, 5, 5},
                                3));
  for (const MeshFile& mesh : {ascii, binary}) {
    EXPECT_EQ(triangles(mesh), "0 1 2, 1 3 2");
    EXPECT_EQ(mesh.vertex_count(), 5u);
    EXPECT_EQ(mesh.dropped, 1u);
  }
  // 1 + 2^-30 is 1 as a float32.
  const std::string near =
      "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
      "vertex 1.000000000931322574615478515625 0 0\nendloop\nendfacet\nendsolid";
  EXPECT_EQ(parse("a.stl", near).dropped, 1u);
  EXPECT_EQ(triangles(parse("a.stl", near, Precision::float64)), "0 1 2");
}

TEST(Stl, ManyVerticesStayDistinctAndNansTakeNoLongerThanNumbers) {
  std::vector<float> corners;
  for (int i = 0; i < 20000; ++i) {
    const float x = static_cast<float>(i);
    corners.insert(corners.end(), {x, 0, 0, x + 1, 0, 0, x, 1, 0});
  }
  const MeshFile mesh = parse("a.stl", binary_stl(corners, 20000));
  EXPECT_EQ(mesh.triangles.size(), 20000u);
  EXPECT_EQ(mesh.vertex_count(), 40001u);
  for (float& x : corners) x = std::nanf("");
  EXPECT_EQ(parse("a.stl", binary_stl(corners, 20000)).vertex_count(), 60000u);
}

TEST(Stl, Refuses) {
  const std::string good = binary_stl({0, 0, 0, 1, 0, 0, 0, 1, 0}, 1);
  EXPECT_EQ(triangles(parse("a.stl", good)), "0 1 2");
  for (std::size_t size = 0; size < good.size(); ++size) refuses("a.stl", good.substr(0, size), {});
  refuses("a.stl", binary_stl({0, 0, 0, 1, 0, 0, 0, 1, 0}, 4000000000u),
          {"byte 80", "4000000000 triangles", "134 bytes"});
  refuses("a.stl", "solid\nfacet\nouter loop\nvertex 0 0 0\n", {"line 5", "end of the file"});
  refuses("a.stl", "solid\nfacet\nouter loop\nvertex 0 0\n", {"line 4", "three coordinates"});
  refuses("a.stl", "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nendloop\n",
          {"line 6", "'endloop'", "vertex"});
  refuses("a.stl", "solid\n", {"end of the file"});
  refuses("a.stl", "not a mesh at all", {"17 bytes"});
}

TEST(MeshFiles, RefusesOtherNamesAndReadsFromDisk) {
  for (const char* name : {"a.gltf", "mesh", "folder.obj/mesh", ".", ""}) {
    EXPECT_THROW(parse(name, "v 0 0 0\n"), scenes::FileError) << name;
  }
  refuses("a.gltf", "{}", {"'.gltf'", ".obj, .off, .ply or .stl"});
  const std::string path = "mesh_file_test.obj";
  std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 3 2 1\n";
  EXPECT_EQ(triangles(read_mesh(path)), "2 1 0");
  std::filesystem::remove(path);
  try {
    read_mesh(path);
    FAIL();
  } catch (const scenes::FileError& error) {
    EXPECT_NE(std::string(error.what()).find("no file"), std::string::npos) << error.what();
  }
  EXPECT_THROW(read_mesh("/dev/null.obj"), scenes::FileError);
}

}  // namespace
}  // namespace throng::meshes
