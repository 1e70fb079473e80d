// Pairs of boxes that do not fit in memory: read from files in blocks, cut into slabs that fit,
// searched slab by slab. The result is that of a single search.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <throng/options.hpp>

namespace throng::stream {

// A .npy file of boxes and one per filter; empty: not given.
struct SetFiles {
  std::string boxes, group, mask, owner, world, is_static;
};

struct Request {
  SetFiles a, b;  // b.boxes empty: one set
  bool round_outward = false;
  // memory_cap_bytes limits all memory, here and in the library. The order is any or canonical.
  Options options;
  std::string output;          // file for the pairs; empty: none
  std::string scratch_folder;  // for boxes that wait, about 30 bytes each, 4 more per filter
  // Called with the share of work done, 0 to 1, increasing, at least a few times per second while
  // boxes are moved; its exceptions propagate.
  std::function<void(double share)> progress;
};

struct FrameResult {
  std::uint64_t pairs = 0, checksum = 0, inactive = 0, comparisons = 0, visited = 0;
  double ms = 0;
};

struct Report {
  std::uint64_t count = 0, count_b = 0;  // boxes in a frame of each set
  std::vector<FrameResult> frames;
  Plan plan;                        // of the last search
  std::uint64_t searches = 0;       // number of library calls
  std::uint64_t slabs = 0;          // at the first cut, all frames
  std::uint64_t scratch_bytes = 0;  // the largest size of the scratch file
  double read_ms = 0;               // reading, cutting, writing and reading slabs
  double search_ms = 0;             // finding pairs and writing them
  double order_ms = 0;              // sorting pairs, if requested
};

// Throws FileError, Failure, and what `progress` throws.
Report run(const Request& request);

// Approximate memory in bytes for a search of all boxes in memory: boxes, filters, workspace.
std::uint64_t bytes_in_memory(const Request& request);

// Throws Failure for a world below -1; `first` is the index of worlds[0] in its file.
void check_worlds(const std::int32_t* worlds, std::size_t count, std::size_t first,
                  const std::string& path);
// Throws Failure unless both have the same number of frames, or one of them has one.
void check_frames(const std::string& a, std::size_t frames_a, const std::string& b,
                  std::size_t frames_b);

}  // namespace throng::stream
