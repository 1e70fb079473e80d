// One finding a row: how it is written, and held against answers that were found elsewhere.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "report/table.hpp"

namespace throng::bench::gpu {

struct Timing {
  double median_ms = 0, min_ms = 0;
  double in_a_row_ms = 0;  // a run, of many between two events only
  std::uint64_t runs = 0;
};

struct Row {
  std::string experiment;
  std::string what;  // the scene, or what of the machine was measured
  std::uint64_t objects = 0;
  std::string order;                      // any, canonical; or the stage
  std::uint64_t pairs = 0, checksum = 0;  // of the first frame
  std::string checksum_by;                // host, device; empty: there is none
  Timing time;
  double pairs_per_box = 0, bytes_per_box = 0;
  double driver_bytes_per_box = 0;  // taken, as cudaMemGetInfo sees it
  double rate = 0;
  std::string rate_unit;
  std::string device;
  std::string note;
};

report::Table table(const std::string& title, const std::vector<Row>& rows);
// All columns, numbers in full.
std::string csv(const std::vector<Row>& rows);
// The goals (bench/results/h200/PENDING.md) that these rows have something to say of.
report::Table summary(const std::vector<Row>& rows);

// Number and checksum of the pairs of a frame, by whoever found them.
struct Answer {
  std::uint64_t pairs = 0, checksum = 0;
  bool operator==(const Answer& o) const { return pairs == o.pairs && checksum == o.checksum; }
};

// scene,objects,frame,pairs,checksum: a file's name stands without its folder.
class Answers {
 public:
  void add(const std::string& scene, std::uint64_t objects, std::uint64_t frame, const Answer&);
  // Null: nothing is known of it.
  const Answer* find(const std::string& scene, std::uint64_t objects, std::uint64_t frame) const;
  std::size_t size() const { return answers_.size(); }
  std::string csv() const;
  // Throws std::invalid_argument, which names the line.
  static Answers read(const std::string& path);

 private:
  std::map<std::string, Answer> answers_;
};

std::string hex(std::uint64_t checksum);

}  // namespace throng::bench::gpu
