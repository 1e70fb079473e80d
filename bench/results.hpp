// Measured values: one schema for the CSV files of all subcommands (bench/results/README.md), and
// the tables on standard output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/report/table.hpp"

namespace throng::bench {

// One value. `kind`, `name`, `objects`, `setting`, `library`, `threads` and `metric` identify it.
struct Row {
  std::string kind;  // the subcommand; of gpu: "gpu-" and the part
  std::string name;  // the case: a scene, a file
  std::uint64_t objects = 0;
  std::string setting;  // what else was chosen
  std::string library;
  unsigned threads = 1;  // 0: does not apply
  std::string metric;    // ends in its unit: update_ms, peak_bytes
  double value = 0;      // the median, if there are several samples
  double least = 0;      // the smallest sample; 0: none
  std::uint64_t samples = 0;
  std::optional<std::uint64_t> found;     // pairs or hits
  std::optional<std::uint64_t> checksum;  // of the pairs
  std::string note;
};

// The median and the minimum of `samples`.
void set_samples(Row& row, const std::vector<double>& samples);

// Where rows come from, and where they go.
struct OutputOptions {
  std::string machine;  // empty: made of the processor's name and its hardware threads
  std::string commit;   // empty: the version of the library
  std::string csv;      // empty: no file
};

std::string csv(const std::vector<Row>& rows, const OutputOptions& options);
// One line per case, setting, library and thread count; one column per metric.
report::Table table(const std::string& title, const std::vector<Row>& rows);

class Results {
 public:
  // Throws scenes::FileError if the CSV file cannot be written.
  explicit Results(OutputOptions options);

  void add(Row row) { rows_.push_back(std::move(row)); }
  // Prints the rows since the last call and writes the CSV file with all rows so far, so that an
  // interrupted run keeps what it measured.
  void show(const std::string& title);

 private:
  OutputOptions options_;
  std::vector<Row> rows_;
  std::size_t shown_ = 0;
};

}  // namespace throng::bench
