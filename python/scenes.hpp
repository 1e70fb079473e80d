// Scenes and files, boxes of bodies, objects that live: what the module has beside its searches.
#pragma once

#include <nanobind/nanobind.h>

namespace throng::python {

void bind_scenes(nanobind::module_& m);
void bind_bodies(nanobind::module_& m);
void bind_live(nanobind::module_& m);

}  // namespace throng::python
