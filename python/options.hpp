// Python's keyword arguments as the library's options.
#pragma once

#include <string>

#include <nanobind/nanobind.h>

#include <throng/broad_phase.hpp>
#include <throng/options.hpp>

#include "python/errors.hpp"

namespace throng::python {

// Each raises TypeError or ValueError that names the keyword.
float margin_of(nb::handle value);
// A finite double, 0 or more.
double length_of(nb::handle value, const char* name);
unsigned threads_of(nb::handle value);
std::size_t bytes_of(nb::handle value, const char* name);
Order order_of(nb::handle value);
Algorithm algorithm_of(nb::handle value);
Backend backend_of(nb::handle value);
NanPolicy nan_of(nb::handle value);
InvertedPolicy inverted_of(nb::handle value);
Isa isa_of(nb::handle value);
SweepHits hits_of(nb::handle value);
// An integer, 0 to `most`.
unsigned long long parse_integer(nb::handle value, const std::string& name,
                                 unsigned long long most);

}  // namespace throng::python
