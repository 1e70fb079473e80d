#include "python/options.hpp"

#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <utility>

namespace throng::python {
namespace {

template <class T>
T choice(nb::handle value, const char* name, std::initializer_list<std::pair<const char*, T>> all) {
  const bool is_text = PyUnicode_Check(value.ptr());
  std::string wanted;
  for (const auto& [text, value_of_name] : all) {
    if (is_text && PyUnicode_CompareWithASCIIString(value.ptr(), text) == 0) return value_of_name;
    wanted += (wanted.empty() ? "'" : ", '") + std::string(text) + "'";
  }
  const std::string message =
      std::string(name) + ": found " + described(value) + ", wanted one of " + wanted;
  if (!is_text) type_error(message);
  value_error(message);
}

}  // namespace

unsigned long long parse_integer(nb::handle value, const std::string& name,
                                 unsigned long long most) {
  const std::string wanted = ", wanted an integer from 0 to " + std::to_string(most);
  const nb::object index = nb::steal(PyNumber_Index(value.ptr()));
  if (!index.is_valid()) {
    PyErr_Clear();
    type_error(name + ": found " + described(value) + wanted);
  }
  const unsigned long long number = PyLong_AsUnsignedLongLong(index.ptr());
  if (PyErr_Occurred() || number > most) {
    PyErr_Clear();
    value_error(name + ": found " + described(value) + wanted);
  }
  return number;
}

namespace {

double number_of(nb::handle value, const char* name) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (number == -1.0 && PyErr_Occurred()) {
    PyErr_Clear();
    type_error(std::string(name) + ": found " + described(value) + ", wanted a number");
  }
  return number;
}

}  // namespace

double length_of(nb::handle value, const char* name) {
  const double length = number_of(value, name);
  if (length >= 0 && length <= std::numeric_limits<double>::max()) return length;
  value_error(std::string(name) + ": found " + described(value) +
              ", wanted a finite number that is not negative");
}

float margin_of(nb::handle value) {
  const double margin = number_of(value, "margin");
  if (!(margin >= 0) || margin > std::numeric_limits<float>::max()) {
    value_error("margin: found " + described(value) +
                ", wanted a finite float32 that is not negative");
  }
  // Upward, so that no pair is lost by it.
  const auto nearest = static_cast<float>(margin);
  if (static_cast<double>(nearest) >= margin) return nearest;
  return std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

unsigned threads_of(nb::handle value) {
  return static_cast<unsigned>(parse_integer(value, "threads", 65535));
}

std::size_t bytes_of(nb::handle value, const char* name) {
  return static_cast<std::size_t>(
      parse_integer(value, name, std::numeric_limits<std::int64_t>::max()));
}

Order order_of(nb::handle value) {
  return choice<Order>(value, "order", {{"any", Order::any}, {"canonical", Order::canonical}});
}

Algorithm algorithm_of(nb::handle value) {
  return choice<Algorithm>(value, "algorithm",
                           {{"auto", Algorithm::automatic},
                            {"all-pairs", Algorithm::all_pairs},
                            {"grid", Algorithm::grid}});
}

Backend backend_of(nb::handle value) {
  return choice<Backend>(value, "backend",
                         {{"auto", Backend::automatic},
                          {"cpu", Backend::cpu},
                          {"cuda", Backend::cuda},
                          {"emulated", Backend::emulated}});
}

NanPolicy nan_of(nb::handle value) {
  return choice<NanPolicy>(value, "nan",
                           {{"refuse", NanPolicy::refuse}, {"inactive", NanPolicy::inactive}});
}

InvertedPolicy inverted_of(nb::handle value) {
  return choice<InvertedPolicy>(
      value, "inverted",
      {{"refuse", InvertedPolicy::refuse}, {"inactive", InvertedPolicy::inactive}});
}

Isa isa_of(nb::handle value) {
  return choice<Isa>(value, "isa",
                     {{"auto", Isa::automatic},
                      {"scalar", Isa::scalar},
                      {"sse4", Isa::sse4},
                      {"avx2", Isa::avx2},
                      {"avx512", Isa::avx512},
                      {"neon", Isa::neon}});
}

SweepHits hits_of(nb::handle value) {
  return choice<SweepHits>(value, "which", {{"all", SweepHits::all}, {"first", SweepHits::first}});
}

}  // namespace throng::python
