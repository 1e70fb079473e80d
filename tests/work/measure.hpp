// Measures the work of every call on a scene, in counts, relative to its input and results.
//
// Cost is Result::comparisons + Result::visited. The budget of a call is the work that its input
// and results justify:
//   Finder            n + pairs
//   update            per changed object 1 + log2 n + its pairs before; plus begun pairs
//   overlap query     per box 1 + log2 n; plus results
//   ray, shape cast   per cast 1 + log2 n; plus results; a cast through the whole scene also what
//   it
//                     passes (WorkScene::path_objects); for the first hit, results are all hits
//                     that are not later
// An index is amortized. A grant of n + pairs is added to the budget
//   - for the first updates and the first queries of a scene (the calls named `build`), once each;
//   - per n objects that changed since the last grant, in the calls that move many.
// Later calls have no grant: there only the budget counts. A sample sums over the calls of its
// kind, so one call may build what the others use. With few objects a call may test all of them,
// and all pairs, so bounds apply from work_least objects on. Smaller scenes are compared with a
// double loop instead.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "work/scenes.hpp"

namespace throng::tests {

enum class Work : std::uint8_t {
  find,
  find_two,
  find_emulated,
  find_two_emulated,
  build,          // adds the objects; the first update
  unpack,         // a hundredth of the objects per frame, 100 frames
  remove_most,    // most objects in one update
  build_moves,    // the first updates with few moved objects
  move_few,       // the next ones
  build_queries,  // each query several times, after updates with few moved objects
  overlap,        // boxes like the objects, near one
  overlap_empty,  // the same, in empty space
  overlap_large,  // boxes up to the size of the scene, mostly outside of it
  ray_first,      // short: a few object sizes
  ray_all,
  ray_long_first,  // up to FLT_MAX
  ray_long_all,
  sweep_first,  // boxes like the objects, short and long casts
  sweep_all,
  query_between,  // overlaps and rays, after moves without an update
  move_many,      // a quarter of the objects or more
  query_moved,    // overlaps and rays after those
  add,            // a hundredth of the objects
  remove,
};
constexpr std::size_t work_least = 1500;
constexpr int work_count = static_cast<int>(Work::remove) + 1;
const char* to_string(Work) noexcept;

struct WorkSample {
  Work work;
  double cost = 0, budget = 0;
  double ratio() const noexcept { return cost / budget; }
};

struct WorkReport {
  std::vector<WorkSample> samples;
  // What differs from the double loop, or failed; empty: nothing. Checked in small scenes only.
  std::string wrong;
};

// Uses one thread, so that a seed gives the same counts again.
WorkReport measure_work(const WorkScene& scene);

}  // namespace throng::tests
