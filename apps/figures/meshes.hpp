// The drawings of triangle meshes. The library decides every case that they show.
#pragma once

#include <string>

namespace throng::figures {

// Signs of a determinant, in rounded doubles and exact.
std::string mesh_side();
// What a pair is, by the number of vertices that two triangles share.
std::string mesh_share_none();
std::string mesh_share_one();
std::string mesh_share_two();
std::string mesh_share_three();
// From triangles to pairs, with the counts of one mesh.
std::string mesh_stages();

}  // namespace throng::figures
