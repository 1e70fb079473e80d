// The parsers of the formats. Internal to meshes/.
#pragma once

#include <string_view>

#include "apps/meshes/mesh_builder.hpp"

namespace throng::meshes {

// `text` is a whole file, not empty. Each throws scenes::FileError.
void parse_obj(std::string_view text, MeshBuilder& builder);
void parse_off(std::string_view text, MeshBuilder& builder);
void parse_ply(std::string_view text, MeshBuilder& builder);
void parse_stl(std::string_view text, MeshBuilder& builder);

}  // namespace throng::meshes
