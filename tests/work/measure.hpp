// The work of every call on a scene, in counts, beside what the call was given and what it found.
//
// Cost is Result::comparisons + Result::visited. The share of a call is what its cost is measured
// by:
//   Finder            n + pairs
//   update            for each object that changed 1 + log2 n + its pairs before, and begun pairs
//   overlap query     for each box 1 + log2 n, and results
//   ray, swept box    for each 1 + log2 n, and results; one that goes through the scene also what
//                     it passes (WorkScene::way); where the first is asked for, the results are all
//                     that are met no later
// An index is amortised. A grant of n + pairs is added to the share
//   - for the first updates and the first queries of a scene (the calls named `build`), once each;
//   - for each n objects that changed since the last grant, in the calls that move many.
// The calls that follow have no grant: there the share alone counts. A sample sums over the calls
// of its kind, so one call may build what the others use.
// Of few objects all may be looked at by each call, and compared with each other: there are bounds
// from work_least objects on. Smaller scenes are held against a double loop instead.
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
  build,          // objects added, and the first update
  unpack,         // a hundredth of the objects a frame, 100 frames
  remove_most,    // most objects in one update
  build_moves,    // the first updates in which few move
  move_few,       // the next
  build_queries,  // each query some times, after updates in which few moved
  overlap,        // boxes like the objects, near one
  overlap_empty,  // the same, beside everything
  overlap_large,  // boxes up to the size of the scene, mostly beside it
  ray_first,      // short: some sizes of an object
  ray_all,
  ray_long_first,  // up to FLT_MAX
  ray_long_all,
  sweep_first,  // boxes like the objects, short and long ways
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
  double cost = 0, share = 0;
  double ratio() const noexcept { return cost / share; }
};

struct WorkReport {
  std::vector<WorkSample> samples;
  // What differed from a double loop, or failed; empty: nothing. Looked at in small scenes alone.
  std::string wrong;
};

// On one thread, so that a seed gives the same counts again.
WorkReport measure_work(const WorkScene& scene);

}  // namespace throng::tests
