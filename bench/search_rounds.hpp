// Interleaved rounds of all methods on one case, medians, and the comparison of their pairs.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/cases.hpp"
#include "bench/competitors/method.hpp"

namespace throng::bench {

struct Settings {
  int rounds = 5;
  std::vector<unsigned> threads;  // parallel methods run with each
  double method_seconds = 1.5;    // the limit for measuring one method at one size
  double limit_seconds = 5;       // slower at one size: not run at the next
  double budget_seconds = 780;    // for all; after that, slow methods are left out
  bool memory = true;
  std::string method_options;  // the command line options that selected the methods
  std::function<void(const std::string&)> progress;  // may be empty
};

struct Measurement {
  std::string scene;
  std::size_t objects = 0;
  std::string method;
  Origin origin = Origin::other_library;
  unsigned threads = 1;
  bool measured = false;
  double ms = 0, least_ms = 0;  // the median and the minimum of all samples
  std::size_t samples = 0;
  std::uint64_t pairs = 0, checksum = 0;  // of the first frame
  bool agrees = true;                     // with the first method, on every frame
  double comparisons = 0;                 // per (box + pair); Throng only
  std::uint64_t peak_bytes = 0;           // growth of resident memory; 0: not measured
  std::string plan;                       // Throng only
  std::string note;                       // how it was run, or why it was not measured
};

class SearchRounds {
 public:
  SearchRounds(Settings settings, std::vector<MethodInfo> methods);

  // All methods on one case. Call with rising sizes: one size decides what runs at the next.
  std::vector<Measurement> measure(const Case& c);
  // Growth of resident memory through two frames of one method. Call it in a separate process.
  static std::uint64_t peak_growth(const MethodInfo& method, const Case& c, unsigned threads);

  const std::vector<MethodInfo>& methods() const { return methods_; }
  double seconds() const;

 private:
  struct Runner;
  // Why it is left out; empty: it runs.
  std::string reason_to_skip(const MethodInfo& method, unsigned threads, const Case& c) const;
  void run_once(Runner& r, const Case& c, std::size_t frame, bool timed);
  bool measures_memory(const Runner& r, const Case& c) const;
  std::uint64_t peak_of(std::size_t method, const Case& c, unsigned threads) const;

  Settings settings_;
  std::vector<MethodInfo> methods_;
  double start_;
  struct Past {
    std::size_t objects = 0;
    double seconds = 0;   // the longest of: a frame, the first frames, the preparation
    double exponent = 1;  // of the growth with the number of objects
  };
  std::map<std::string, Past> past_;            // by scene, method, threads
  std::map<std::string, std::string> dropped_;  // by scene and method: the faster setting
  struct Expected {
    std::uint64_t pairs, checksum;
  };
  std::map<std::size_t, Expected> expected_;  // by frame, of the current case
};

}  // namespace throng::bench
