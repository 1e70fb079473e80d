// Interleaved rounds, medians, and the comparison of what was found.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/contender.hpp"

namespace throng::bench {

struct Settings {
  int rounds = 5;
  std::vector<unsigned> threads;   // of which parallel contenders get a row each
  double contender_seconds = 1.5;  // measuring one contender at one size ends after so long
  double limit_seconds = 5;        // slower at one size: not run at the next
  double budget_seconds = 780;     // for all; then slow contenders are left out
  bool memory = true;
  std::string entry_options;  // the words of the command line that chose the entries
  std::function<void(const std::string&)> progress;  // may be empty
};

struct Row {
  std::string scene;
  std::size_t objects = 0;
  std::string contender;
  Kind kind = Kind::rival;
  unsigned threads = 1;
  bool measured = false;
  double ms = 0, best_ms = 0;  // the median of all samples, and the least
  std::size_t samples = 0;
  std::uint64_t pairs = 0, checksum = 0;  // of the first frame
  bool agrees = true;                     // with the first contender, on every frame it ran on
  double comparisons = 0;                 // per (box + pair); Throng only
  std::uint64_t peak_bytes = 0;           // growth of resident memory; 0: not measured
  std::string plan;                       // Throng only
  std::string note;                       // what the reader must know, or why it was not measured
};

class Bench {
 public:
  Bench(Settings settings, std::vector<Entry> entries);

  // All contenders on one case. Call with sizes rising: the last size decides who runs at the next.
  std::vector<Row> measure(const Case& c);
  // Growth of resident memory through two frames of one contender; for a process of its own.
  static std::uint64_t peak_growth(const Entry& entry, const Case& c, unsigned threads);

  const std::vector<Entry>& entries() const { return entries_; }
  double seconds() const;

 private:
  struct Runner;
  // Why it is left out; empty: it runs.
  std::string excuse(const Entry& entry, unsigned threads, const Case& c) const;
  void run_once(Runner& r, const Case& c, std::size_t frame, bool timed);
  bool worth_weighing(const Runner& r, const Case& c) const;
  std::uint64_t peak_of(std::size_t entry, const Case& c, unsigned threads) const;

  Settings settings_;
  std::vector<Entry> entries_;
  double start_;
  struct Past {
    std::size_t objects = 0;
    double seconds = 0;   // the longest of: a frame, the first ones, what came before them
    double exponent = 1;  // how it grew
  };
  std::map<std::string, Past> past_;            // by scene, contender, threads
  std::map<std::string, std::string> dropped_;  // by scene and contender: the faster setting
  struct Expected {
    std::uint64_t pairs, checksum;
  };
  std::map<std::size_t, Expected> expected_;  // by frame, of the case at hand
};

}  // namespace throng::bench
