// Runs a Finder over the frames of an input, again and again, and keeps what is told of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <throng/finder.hpp>

#include "cli/input.hpp"

namespace throng::cli {

struct FrameReport {
  std::uint64_t pairs = 0, checksum = 0, inactive = 0, comparisons = 0, visited = 0;
  StageTimes stages;    // medians over the warmed runs
  double total_ms = 0;  // the same, from outside: call to return
};

// What is told of a search of boxes that were not in memory all at once.
struct StreamedReport {
  std::uint64_t slabs = 0, searches = 0, scratch_bytes = 0;
  double read_ms = 0;
};

struct SearchReport {
  std::uint64_t count = 0;               // boxes in a frame
  std::optional<std::uint64_t> count_b;  // of the second set
  std::vector<FrameReport> frames;
  double first_ms = 0;  // the first call of all, cold
  std::optional<std::uint64_t> peak_bytes;
  Plan plan;  // of the last frame
  std::optional<StreamedReport> streamed;

  FrameReport sum() const;  // over the frames; checksums modulo 2^64
};

struct SearchRequest {
  Options options;  // with a memory cap: the consumer form
  program::Remedies remedies;
  std::size_t repeat = 1;
  std::string output;  // file for the pairs; empty: none
};

// Once cold over all frames, which also gives pairs and checksum and writes the output (the frames
// one after another), then `repeat` times warmed. Throws Failure, FileError, Interrupted.
SearchReport run_search(const Input& input, const SearchRequest& request);

// Under a cap of memory_cap_bytes for boxes, filters and workspace together: as run_search where
// they fit, else the boxes are read in slabs (stream/), once, whatever `repeat` says.
SearchReport run_capped_search(const InputArguments& input, SearchRequest request);

}  // namespace throng::cli
