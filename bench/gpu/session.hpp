// What a run of the subcommand gpu collects, and its parts.
#pragma once

#include <string>
#include <vector>

#include "bench/gpu/cases.hpp"
#include "bench/gpu/measurement.hpp"

namespace throng::bench::gpu {

struct Session {
  double budget_ms = 1000;  // of replays per measurement
  const Answers* expected = nullptr;
  double copy_gbs = 0;  // bandwidth of this device, measured in this run; 0: not yet
  std::vector<Measurement> measurements;
  std::size_t checked = 0, unknown = 0;  // frames compared with `expected`; frames not in it
  std::vector<std::string> wrong;        // disagreements, as messages
};

// One measurement unsorted and, if the case says so, one sorted; of a file one per frame.
void measure_search(const Case& c, Session& s);
// One measurement per stage, with the bytes that it must move.
void measure_stages(const Case& c, Session& s);
// update_boxes: one measurement per kind of shape; every box is compared with the host's.
void measure_bodies(Session& s, std::size_t most);
// Updates of persistent objects: one measurement per kind of motion. Bytes per box are all memory.
void measure_tracking(Session& s, std::size_t least, std::size_t most);
// Queries to such objects: one measurement per kind and number; some are compared with the CPU.
void measure_queries(Session& s, std::size_t least, std::size_t most);
// Launches, copies, sorts, scans, atomics, gathers of the device. Sets copy_gbs.
void measure_device_limits(Session& s, std::size_t most);
// Measures only large copies.
double copy_bandwidth_gbs();

// Adds what the CPU finds in each frame.
void answer_by_cpu(const Case& c, unsigned threads, Answers& answers);

}  // namespace throng::bench::gpu
