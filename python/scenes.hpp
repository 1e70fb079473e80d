// What the module has beside its searches: what they tell, scenes and files, boxes of bodies,
// objects that live.
#pragma once

#include <nanobind/nanobind.h>

namespace throng::python {

void bind_results(nanobind::module_& m);
void bind_scenes(nanobind::module_& m);
void bind_bodies(nanobind::module_& m);
void bind_live(nanobind::module_& m);

}  // namespace throng::python
