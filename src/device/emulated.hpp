// Backend::emulated: the search of a device on the CPU. A source of its own, so that its templates
// are compiled once, and with few optimizations.
#pragma once

#include <cstddef>

#include <throng/finder.hpp>
#include <throng/mesh.hpp>
#include <throng/options.hpp>

#include "base/output.hpp"
#include "device/engine.hpp"
#include "device/host_device.hpp"
#include "mesh/triangle_boxes.hpp"

namespace throng::device {

using EmulatedEngine = Engine<HostDevice>;

// Engine::find on options.threads threads of the options' executor. Throws the same.
void find_emulated(EmulatedEngine& engine, const Boxes& a, const Boxes* b, const Options& options,
                   std::size_t already_held, base::Output* output, const Consumer* consumer,
                   Result& r);

// The same for meshes. Returns what is wrong with the triangles, and with which mesh.
struct EmulatedDefects {
  mesh::MeshDefects defects;
  bool in_second = false;
};
EmulatedDefects find_emulated(EmulatedEngine& engine, const TriangleMesh& a, const TriangleMesh* b,
                              const Options& options, std::size_t already_held,
                              base::Output* output, const Consumer* consumer, MeshResult& r);

}  // namespace throng::device
