#include "apps/meshes/mesh_file.hpp"

#include <cctype>
#include <memory>

#include "apps/meshes/formats.hpp"
#include "apps/scenes/input_file.hpp"
#include "apps/scenes/npy_header.hpp"

namespace throng::meshes {
namespace {

using Parse = void (*)(std::string_view text, MeshBuilder& builder);

struct Format {
  const char* suffix;
  Parse parse;
  bool has_indices = true;
};
constexpr Format formats[] = {
    {".obj", parse_obj}, {".off", parse_off}, {".ply", parse_ply}, {".stl", parse_stl, false}};

const Format& format_of(const std::string& name) {
  const std::size_t slash = name.find_last_of("/\\");
  const std::size_t dot = name.rfind('.');
  std::string suffix;
  if (dot != std::string::npos && (slash == std::string::npos || dot > slash)) {
    for (const char c : name.substr(dot)) {
      suffix += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  for (const Format& format : formats) {
    if (suffix == format.suffix) return format;
  }
  scenes::throw_file_error(name, suffix.empty() ? "no suffix" : "the suffix '" + suffix + "'",
                           "a mesh in .obj, .off, .ply or .stl");
}

MeshFile parse(const Format& format, std::string_view bytes, const std::string& name,
               Precision precision) {
  if (bytes.empty()) scenes::throw_file_error(name, "an empty file", "a mesh");
  MeshBuilder builder(name, precision);
  format.parse(bytes, builder);
  MeshFile mesh = builder.finish();
  if (!format.has_indices) weld_vertices(mesh);
  return mesh;
}

}  // namespace

MeshFile read_mesh(const std::string& path, Precision precision) {
  const Format& format = format_of(path);
  std::uint64_t size = 0;
  const auto file = scenes::open_regular_file(path, "mesh", size);
  // One byte more, so that a file that grows is noticed.
  const std::unique_ptr<char[]> bytes(new char[static_cast<std::size_t>(size) + 1]);
  const std::size_t got =
      std::fread(bytes.get(), 1, static_cast<std::size_t>(size) + 1, file.get());
  if (std::ferror(file.get()) != 0 || got != size) {
    scenes::throw_file_error(path, "a file that changed or failed while read",
                             std::to_string(size) + " bytes");
  }
  return parse(format, {bytes.get(), got}, path, precision);
}

MeshFile parse_mesh(const char* data, std::size_t size, const std::string& name,
                    Precision precision) {
  return parse(format_of(name), {data, size}, name, precision);
}

}  // namespace throng::meshes
