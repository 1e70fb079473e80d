// The module's other parts: results, scenes and files, boxes of bodies, persistent objects,
// triangle meshes.
#pragma once

#include <nanobind/nanobind.h>

namespace throng::python {

void bind_results(nanobind::module_& m);
void bind_scenes(nanobind::module_& m);
void bind_bodies(nanobind::module_& m);
void bind_live(nanobind::module_& m);
void bind_mesh(nanobind::module_& m);
void bind_contact(nanobind::module_& m);

}  // namespace throng::python
