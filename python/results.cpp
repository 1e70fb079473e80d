// The results of searches as Python objects: Result and its parts, Explanation.
#include <cstdio>
#include <string>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <throng/explain.hpp>
#include <throng/mesh.hpp>

#include "python/arrays.hpp"
#include "python/scenes.hpp"

namespace throng::python {
namespace {

std::string fixed(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", value);
  return text;
}

nb::tuple bounds(const Box& b) {
  return nb::make_tuple(b.lower.x, b.lower.y, b.lower.z, b.upper.x, b.upper.y, b.upper.z);
}

void bind_result(nb::module_& m) {
  nb::class_<StageTimes>(m, "StageTimes", "How long each stage of a search took, in milliseconds.")
      .def_ro("plan_ms", &StageTimes::plan_ms, "sampling, planning, splitting by world and static")
      .def_ro("bin_ms", &StageTimes::bin_ms, "reading, checking and sorting the boxes into columns")
      .def_ro("find_ms", &StageTimes::find_ms, "finding and writing pairs")
      .def_ro("order_ms", &StageTimes::order_ms, "sorting pairs, where order is 'canonical'")
      .def_ro("total_ms", &StageTimes::total_ms)
      .def("__repr__", [](const StageTimes& t) {
        return "StageTimes(plan_ms=" + fixed(t.plan_ms) + ", bin_ms=" + fixed(t.bin_ms) +
               ", find_ms=" + fixed(t.find_ms) + ", order_ms=" + fixed(t.order_ms) +
               ", total_ms=" + fixed(t.total_ms) + ")";
      });
  nb::class_<Plan>(m, "Plan", "What the planner chose, and why.")
      .def_prop_ro("backend", [](const Plan& p) { return throng::to_string(p.backend); })
      .def_prop_ro("algorithm", [](const Plan& p) { return throng::to_string(p.algorithm); })
      .def_prop_ro("isa", [](const Plan& p) { return throng::to_string(p.isa); })
      .def_ro("threads", &Plan::threads)
      .def_ro("sweep_axis", &Plan::sweep_axis, "0, 1, 2: along which each column is swept")
      .def_prop_ro(
          "columns",
          [](const Plan& p) { return nb::make_tuple(p.columns[0], p.columns[1], p.columns[2]); },
          "number of columns, or finest cells, along each axis")
      .def_ro("expected_ns", &Plan::expected_ns, "the planner's cost estimate")
      .def_prop_ro(
          "reason", [](const Plan& p) { return p.reason; }, "one sentence")
      .def("__repr__", [](const Plan& p) {
        return std::string("Plan(algorithm='") + throng::to_string(p.algorithm) + "', isa='" +
               throng::to_string(p.isa) + "', threads=" + std::to_string(p.threads) + ", reason='" +
               p.reason + "')";
      });
  nb::class_<Result>(m, "Result", "Counts, plan and times of a search.")
      .def_prop_ro(
          "status", [](const Result& r) { return throng::to_string(r.status); },
          "'ok', or 'stopped' where a consumer wanted no more")
      .def_ro("found", &Result::found, "number of pairs found")
      .def_ro("written", &Result::written, "pairs returned, or handed to the consumer")
      .def_ro("inactive", &Result::inactive,
              "boxes that overlap nothing: lower > upper, or a NaN where allowed")
      .def_ro("comparisons", &Result::comparisons, "candidate pairs compared")
      .def_ro("visited", &Result::visited,
              "cells, columns, records and tree nodes visited, in addition to comparisons")
      .def_ro("plan", &Result::plan)
      .def_ro("times", &Result::times)
      .def("__repr__", [](const Result& r) {
        return std::string("Result(status='") + throng::to_string(r.status) +
               "', found=" + std::to_string(r.found) + ", inactive=" + std::to_string(r.inactive) +
               ", comparisons=" + std::to_string(r.comparisons) +
               ", visited=" + std::to_string(r.visited) + ", total_ms=" + fixed(r.times.total_ms) +
               ")";
      });
  nb::class_<MeshResult, Result>(m, "MeshResult",
                                 "Counts, plan and times of a search of triangles.")
      .def_ro("candidates", &MeshResult::candidates,
              "pairs of triangles whose boxes overlap, each tested once")
      .def_ro("exact_tests", &MeshResult::exact_tests,
              "candidates that floating-point arithmetic could not decide");
}

void bind_explanation(nb::module_& m) {
  using SizeClass = Explanation::SizeClass;
  using LargeBox = Explanation::LargeBox;
  using DenseCell = Explanation::DenseCell;
  nb::class_<SizeClass>(m, "SizeClass", "Boxes of similar largest extent.")
      .def_ro("least", &SizeClass::from, "lower limit of their extent (inclusive), in world units")
      .def_ro("below", &SizeClass::below, "upper limit (exclusive); 0: boxes of no extent")
      .def_ro("boxes", &SizeClass::boxes, "how many")
      .def_ro("cells_per_box", &SizeClass::cells_per_box, "0 where there are no cells");
  nb::class_<LargeBox>(m, "LargeBox", "One of the largest boxes.")
      .def_ro("index", &LargeBox::index)
      .def_ro("in_second_set", &LargeBox::in_second_set, "whether it belongs to `other`")
      .def_ro("extent", &LargeBox::extent, "the largest of the three, in world units")
      .def_ro("cells", &LargeBox::cells, "number of cells that it touches");
  nb::class_<DenseCell>(m, "DenseCell", "One of the cells with the most boxes.")
      .def_prop_ro(
          "bounds", [](const DenseCell& c) { return bounds(c.bounds); },
          "lower x, y, z, upper x, y, z; the outermost cells extend to infinity")
      .def_ro("boxes", &DenseCell::boxes, "how many");
  using CellClass = Explanation::CellClass;
  nb::class_<CellClass>(m, "CellClass", "Cells with similar numbers of boxes.")
      .def_ro("least", &CellClass::from, "lower limit of their number of boxes (inclusive)")
      .def_ro("below", &CellClass::below, "upper limit (exclusive)")
      .def_ro("cells", &CellClass::cells, "how many")
      .def_ro("boxes", &CellClass::boxes, "number of boxes in all of them");
  using Candidate = Explanation::Candidate;
  nb::class_<Candidate>(m, "Candidate", "A way to search, with its expected time.")
      .def_prop_ro(
          "algorithm", [](const Candidate& c) { return throng::to_string(c.algorithm); },
          "'all-pairs' or 'grid'")
      .def_ro("sweep_axis", &Candidate::sweep_axis, "0, 1 or 2")
      .def_prop_ro(
          "columns",
          [](const Candidate& c) {
            return nb::make_tuple(c.columns[0], c.columns[1], c.columns[2]);
          },
          "of the grid, along x, y, z")
      .def_ro("expected_ns", &Candidate::expected_ns, "expected time on one thread, ns");
  nb::class_<Explanation>(m, "Explanation", "Why a search costs what it does.")
      .def_ro("result", &Explanation::result, "of the explained search")
      .def_ro("boxes", &Explanation::boxes, "of both sets, inactive ones included")
      .def_ro("cells", &Explanation::cells, "of the grid; 0: there is no single grid for all boxes")
      .def_ro("entries", &Explanation::entries,
              "entries of boxes in cells: a box is in every cell that it touches")
      .def_ro("occupied", &Explanation::occupied, "cells with a box in them")
      .def_ro("tests_per_pair", &Explanation::tests_per_pair,
              "candidate pairs compared per pair found; 0: none was found")
      .def_ro("tests_per_box", &Explanation::tests_per_box, "and per box")
      .def_ro("memory_bytes", &Explanation::memory_bytes, "held by the Finder")
      .def_ro("size_classes", &Explanation::size_classes,
              "by largest extent, in classes of a factor of two, the smallest first")
      .def_ro("largest", &Explanation::largest, "up to ten boxes")
      .def_ro("densest", &Explanation::densest, "up to ten cells")
      .def_ro("cell_classes", &Explanation::cell_classes,
              "cells by number of boxes, in classes of a factor of two, the emptiest "
              "first; without empty cells")
      .def_prop_ro(
          "occupancy",
          [](const Explanation& e) {
            const auto& n = e.result.plan.columns;
            const bool there = !e.occupancy.empty();
            auto copy = std::make_unique<std::uint32_t[]>(e.occupancy.size() + 1);
            std::copy(e.occupancy.begin(), e.occupancy.end(), copy.get());
            const auto along = [&](int k) { return std::size_t{there ? n[k] : 0}; };
            return numpy_array(std::move(copy), {along(0), along(1), along(2)});
          },
          "boxes in each cell, uint32 by x, y, z; of shape (0, 0, 0) where there are no cells")
      .def_prop_ro(
          "grid", [](const Explanation& e) { return bounds(e.grid); },
          "lower x, y, z, upper x, y, z: the region that the cells divide into equal parts")
      .def_ro(
          "candidates", &Explanation::candidates,
          "brute force and the best grid along each axis, the shortest expected time first; empty "
          "without a single plan for all boxes")
      .def_prop_ro(
          "memory",
          [](const Explanation& e) {
            nb::dict parts;
            for (const Explanation::Part& part : e.memory) parts[part.what] = part.bytes;
            return parts;
          },
          "memory by purpose, in bytes")
      .def_ro("advice", &Explanation::advice,
              "suggestions to make it faster, each a sentence with its reason")
      .def("__repr__", [](const Explanation& e) {
        return "Explanation(boxes=" + std::to_string(e.boxes) +
               ", cells=" + std::to_string(e.cells) + ", tests_per_box=" + fixed(e.tests_per_box) +
               ", advice=" + std::to_string(e.advice.size()) + ")";
      });
}

}  // namespace

void bind_results(nb::module_& m) {
  bind_result(m);
  bind_explanation(m);
}

}  // namespace throng::python
