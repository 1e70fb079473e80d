// Scenes and files, and boxes of bodies: what the module has beside its searches.
#pragma once

#include <nanobind/nanobind.h>

namespace throng::python {

void bind_scenes(nanobind::module_& m);
void bind_bodies(nanobind::module_& m);

}  // namespace throng::python
