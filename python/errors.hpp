// Exceptions of the kinds that Python's users expect; each names the argument, what it was, and
// what to give instead. All are called with the interpreter's lock held.
#pragma once

#include <string>

#include <nanobind/nanobind.h>

#include <throng/options.hpp>

namespace throng::python {

namespace nb = nanobind;

[[noreturn]] void type_error(const std::string& text);
[[noreturn]] void value_error(const std::string& text);
[[noreturn]] void memory_error(const std::string& text);

// "'text'", a number, or "a list": what an argument was, in few words.
std::string described(nb::handle value);

// What the library says, with the names and remedies of this language.
std::string in_python(std::string text);

// The exception for a call that was not ok; nothing for one that is.
void require_ok(const Result& result);

}  // namespace throng::python
