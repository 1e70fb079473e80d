// One measurement on the GPU, and the answers that it is compared with.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "apps/report/table.hpp"
#include "bench/results.hpp"

namespace throng::bench::gpu {

struct Timing {
  double median_ms = 0, min_ms = 0;
  double back_to_back_ms = 0;  // per run, of many runs between two events
  std::uint64_t runs = 0;
};

struct Measurement {
  std::string experiment;
  std::string what;  // the case: a scene, a file, a property of the device
  std::uint64_t objects = 0;
  std::string setting;                    // order, stage, number of queries
  std::uint64_t pairs = 0, checksum = 0;  // of the first frame
  std::string checksum_by;                // host, device; empty: no checksum
  Timing time;
  double pairs_per_box = 0, bytes_per_box = 0;
  double driver_bytes_per_box = 0;  // by cudaMemGetInfo
  double rate = 0;
  std::string rate_metric;  // the metric of `rate`, which ends in its unit
  std::string note;
};

report::Table table(const std::string& title, const std::vector<Measurement>& measurements);
// One row per metric, of the schema that all subcommands share.
std::vector<Row> rows(const std::vector<Measurement>& measurements);

// Number and checksum of the pairs of a frame.
struct Answer {
  std::uint64_t pairs = 0, checksum = 0;
  bool operator==(const Answer& o) const { return pairs == o.pairs && checksum == o.checksum; }
};

// A file with the columns scene,objects,frame,pairs,checksum; the name of a file is without
// folders.
class Answers {
 public:
  void add(const std::string& scene, std::uint64_t objects, std::uint64_t frame, const Answer&);
  // Null: not in the file.
  const Answer* find(const std::string& scene, std::uint64_t objects, std::uint64_t frame) const;
  std::size_t size() const { return answers_.size(); }
  std::string csv() const;
  // Throws std::invalid_argument, whose message has the line number.
  static Answers read(const std::string& path);

 private:
  std::map<std::string, Answer> answers_;
};

std::string hex(std::uint64_t checksum);

}  // namespace throng::bench::gpu
