// Exceptions of the conventional Python types; each names the argument, the value found, and the
// fix. All functions need the interpreter's lock.
#pragma once

#include <string>

#include <nanobind/nanobind.h>

#include <throng/options.hpp>

namespace throng::python {

namespace nb = nanobind;

[[noreturn]] void type_error(const std::string& text);
[[noreturn]] void value_error(const std::string& text);
[[noreturn]] void memory_error(const std::string& text);

// "'text'", a number, or "a list": a short description of an argument.
std::string described(nb::handle value);

// The library's message, with Python's names and fixes.
std::string in_python(std::string text);

// The exception for a failed call; returns for one that is ok.
void require_ok(const Result& result);

}  // namespace throng::python
