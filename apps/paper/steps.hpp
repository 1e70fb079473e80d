// The paper's system on any device. Device is HostDevice (host.hpp) or the CUDA one (cuda.cu).
#pragma once

#include <memory>
#include <string>

#include "apps/paper/brute_force.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/grid_search.hpp"
#include "apps/paper/stepper.hpp"

namespace throng::paper {

template <class Device>
std::unique_ptr<Stepper> make_stepper(const Job& job) {
  if (job.n > max_objects) {
    throw Failure("found " + std::to_string(job.n) + " objects, and the radicand of the mapping " +
                  "formula overflows 63 bits beyond " + std::to_string(max_objects) +
                  "; split the set");
  }
  if (job.variant.per_cell > 0) {
    if (job.variant.mapping == MappingKind::stored) {
      throw Failure(
          "the stored list holds the pairs of all n objects, and a cell of the grid has " +
          std::string("a list of its own length; use another --mapping with --grid"));
    }
    return std::make_unique<GridSearch<Device>>(job);
  }
  return std::make_unique<BruteForce<Device>>(job);
}

}  // namespace throng::paper
