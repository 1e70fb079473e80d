// One variant, set up once for so many objects, and run step by step on the host or on a GPU.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "paper/variant.hpp"

namespace throng::paper {

// The stages of a step, in ms. What a form of the system has no use for is 0.
struct Times {
  double upload = 0;    // boxes to the device
  double boxes = 0;     // update of the bounding volumes
  double grid = 0;      // update of the grid
  double search = 0;    // brute force
  double download = 0;  // output to the host
  double decode = 0;    // the host makes a list of a matrix

  // Until the output is on the host, in whatever form.
  double total() const noexcept { return upload + boxes + grid + search + download; }
};

struct Step {
  std::vector<Pair> pairs;  // first < second where the mapping is right; in any order
  std::uint64_t output_bytes = 0;
  std::uint64_t cells = 0, entries = 0;  // of the grid
  Times times;
};

struct Job {
  Variant variant;
  std::uint64_t n = 0;
  Box environment{};                                    // for the grid
  std::uint64_t memory_bytes = std::uint64_t{4} << 30;  // for output, stored list, grid: each
  unsigned threads = 1;                                 // of the host
};

class Stepper {
 public:
  virtual ~Stepper() = default;
  // The pairs of these n boxes, as the variant finds them. The result is valid until the next call.
  virtual const Step& step(const Box* boxes) = 0;
};

// Failure where n, TooLarge where the memory that the variant takes for n objects, is too large.
std::unique_ptr<Stepper> make_host_stepper(const Job& job);

// Time of `count` square roots, of 0 .. count - 1: the median of `repeat` runs. `sum` is made of
// the roots, so that none of them can be left out.
struct RootTime {
  double ms = 0;
  std::uint64_t sum = 0;
};
RootTime time_roots_on_host(RootKind kind, int steps, std::uint64_t count, int repeat,
                            unsigned threads);

// Time of the way from thread to pair alone, for all pairs of n objects, likewise.
struct MappingTime {
  double ms = 0;
  std::uint64_t sum = 0;
};
MappingTime time_mapping_on_host(const Variant& variant, std::uint64_t n, int repeat,
                                 unsigned threads);

// TooLarge that names the bytes and the remedy, where they are more than the limit.
void require_memory(std::uint64_t bytes, std::uint64_t limit, const std::string& what,
                    const std::string& remedy);

}  // namespace throng::paper
