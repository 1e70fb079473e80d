// One variant, set up once for a number of objects, and run step by step on the host or on a GPU.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "apps/paper/variant.hpp"

namespace throng::paper {

// The stages of a step, in ms; 0 for stages that a variant does not have.
struct Times {
  double upload = 0;    // boxes to the device
  double boxes = 0;     // update of the bounding volumes
  double grid = 0;      // update of the grid
  double search = 0;    // brute force
  double download = 0;  // output to the host
  double decode = 0;    // the host decodes a matrix into a list

  // Until the output is on the host, in any form.
  double total() const noexcept { return upload + boxes + grid + search + download; }
};

struct Step {
  std::vector<Pair> pairs;  // first < second where the mapping is right; unsorted
  std::uint64_t output_bytes = 0;
  std::uint64_t cells = 0, entries = 0;  // of the grid
  Times times;
};

struct Job {
  Variant variant;
  std::uint64_t n = 0;
  Box environment{};                                    // for the grid
  std::uint64_t memory_bytes = std::uint64_t{4} << 30;  // per output, stored list, or grid
  unsigned threads = 1;                                 // of the host
};

class Stepper {
 public:
  virtual ~Stepper() = default;
  // The pairs of these n boxes, as the variant finds them. The result is valid until the next call.
  virtual const Step& step(const Box* boxes) = 0;
};

// Throws Failure where n is too large, TooLarge where the variant's memory for n objects is.
std::unique_ptr<Stepper> make_host_stepper(const Job& job);

// Median time of `count` square roots, of 0 .. count - 1, over `repeat` runs. `sum` depends on all
// roots, so that none is optimized away.
struct RootTime {
  double ms = 0;
  std::uint64_t sum = 0;
};
RootTime time_roots_on_host(RootKind kind, int steps, std::uint64_t count, int repeat,
                            unsigned threads);

// Time of the mapping from thread to pair alone, for all pairs of n objects, likewise.
struct MappingTime {
  double ms = 0;
  std::uint64_t sum = 0;
};
MappingTime time_mapping_on_host(const Variant& variant, std::uint64_t n, int repeat,
                                 unsigned threads);

// Throws TooLarge, naming the bytes and the fix, where they exceed the limit.
void require_memory(std::uint64_t bytes, std::uint64_t limit, const std::string& what,
                    const std::string& remedy);

}  // namespace throng::paper
