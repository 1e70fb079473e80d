// Runs a Finder over all frames of an input, repeatedly, and collects the results.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <throng/finder.hpp>

#include "apps/throng/input.hpp"

namespace throng::cli {

struct FrameReport {
  std::uint64_t pairs = 0, checksum = 0, inactive = 0, comparisons = 0, visited = 0;
  StageTimes stages;    // medians over the warmed runs
  double total_ms = 0;  // the same, measured outside: call to return
};

// Results of a streamed search, where the boxes were not in memory all at once.
struct StreamedReport {
  std::uint64_t slabs = 0, searches = 0, scratch_bytes = 0;
  double read_ms = 0;
};

struct SearchReport {
  std::uint64_t count = 0;               // boxes in a frame
  std::optional<std::uint64_t> count_b;  // of the second set
  std::vector<FrameReport> frames;
  double first_ms = 0;  // the very first call, cold
  std::optional<std::uint64_t> peak_bytes;
  Plan plan;  // of the last frame
  std::optional<StreamedReport> streamed;

  FrameReport sum() const;  // sums over the frames; checksums modulo 2^64
};

struct SearchRequest {
  Options options;  // with a memory cap: the consumer form
  common::HintOptions hint_options;
  std::size_t repeat = 1;
  std::string output;  // file for the pairs; empty: none
};

// One cold run over all frames gives pairs and checksum and writes the output (frame after frame);
// then `repeat` warmed runs. Throws Failure, FileError, Interrupted.
SearchReport run_search(const Input& input, const SearchRequest& request);

// With memory_cap_bytes for boxes, filters and workspace together: as run_search where they fit;
// else the boxes are read in slabs (stream/), once, whatever `repeat` is.
SearchReport run_capped_search(const InputArguments& input, SearchRequest request);

}  // namespace throng::cli
