// Any bytes as a mesh file, the first for its format: a mesh with valid indices or a FileError,
// never a crash nor a large allocation.
#include <string>

#include "apps/meshes/mesh_file.hpp"
#include "apps/scenes/npy.hpp"
#include "fuzz/target.hpp"

namespace throng::tests {

void run(Bytes& bytes) {
  static const char* const names[] = {"fuzz.obj", "fuzz.off", "fuzz.ply", "fuzz.stl"};
  if (bytes.empty()) return;
  const std::string name = names[static_cast<unsigned char>(bytes.next()) % 4];
  std::string text;
  while (!bytes.empty()) text += static_cast<char>(bytes.next());
  for (const auto precision : {meshes::Precision::float32, meshes::Precision::float64}) {
    try {
      const meshes::MeshFile mesh = meshes::parse_mesh(text.data(), text.size(), name, precision);
      // Each comes from at least one byte.
      if (mesh.vertex_count() > text.size() || mesh.triangles.size() + mesh.dropped > text.size())
        throw Difference("more vertices or triangles than bytes");
      for (const Triangle& t : mesh.triangles) {
        if (t.a >= mesh.vertex_count() || t.b >= mesh.vertex_count() || t.c >= mesh.vertex_count())
          throw Difference("an index without a vertex");
        if (t.a == t.b || t.b == t.c || t.c == t.a) throw Difference("a repeated index");
      }
    } catch (const scenes::FileError& error) {
      if (std::string(error.what()).find(name) == std::string::npos)
        throw Difference(std::string("an error without the file's name: ") + error.what());
    }
  }
}

}  // namespace throng::tests
