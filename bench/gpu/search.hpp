// One case on the GPU and on the CPU.
#pragma once

#include <string>
#include <vector>

#include "bench/gpu/cases.hpp"
#include "bench/gpu/row.hpp"

namespace throng::bench::gpu {

struct Session {
  std::string device;
  double budget_ms = 1000;  // of replays, a row
  const Answers* expected = nullptr;
  double copy_gbs = 0;  // of this device, measured in this run; 0: not yet
  std::vector<Row> rows;
  std::size_t checked = 0, unknown = 0;  // frames held against `expected`; not found there
  std::vector<std::string> wrong;        // disagreements, in words
};

// Adds a row in any order, one in canonical where asked; of a file one a frame.
void measure_search(const Case& c, Session& s);
// A row a stage, with the bytes that it moves by count.
void measure_stages(const Case& c, Session& s);
// update_boxes: a row a kind of shapes, every box held against the host's.
void measure_bodies(Session& s, std::size_t most);
// Updates of objects that live: a row a way to move. Bytes a box are all that is held.
void measure_live(Session& s, std::size_t least, std::size_t most);
// Questions to such objects: a row a kind and number of them, some held against the CPU.
void measure_questions(Session& s, std::size_t least, std::size_t most);
// Launches, copies, sorts, scans, atomics, gathers: what the machine does. Sets copy_gbs.
void measure_machine(Session& s, std::size_t most);
// Large copies alone.
double copy_bandwidth_gbs();

// What the CPU finds in each frame.
void answer_by_cpu(const Case& c, unsigned threads, Answers& answers);

}  // namespace throng::bench::gpu
