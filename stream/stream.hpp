// Pairs of boxes that do not fit in memory: read from their files in blocks, cut into slabs that
// fit, searched slab by slab. What is found is what one search of all would find.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <throng/options.hpp>

namespace throng::stream {

// A .npy file of boxes and one a filter; empty: not given.
struct SetFiles {
  std::string boxes, group, mask, owner, world, is_static;
};

struct Request {
  SetFiles a, b;  // b.boxes empty: one set
  bool round_outward = false;
  // memory_cap_bytes: all that is taken, here and in the library. The order is any or canonical.
  Options options;
  std::string output;          // file for the pairs; empty: none
  std::string scratch_folder;  // where boxes wait their turn, some 30 bytes each, 4 more a filter
  // Called with rising shares of the work, 0 to 1, some times a second at least while boxes move;
  // what it throws comes through.
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
  std::uint64_t searches = 0;       // calls of the library
  std::uint64_t slabs = 0;          // at the first cut, all frames
  std::uint64_t scratch_bytes = 0;  // the most that lay on the disk for a time
  double read_ms = 0;               // reading, cutting, writing and reading slabs
  double search_ms = 0;             // finding pairs and writing them
  double order_ms = 0;              // sorting pairs, where asked for
};

// Throws FileError, Failure, and what `progress` throws.
Report run(const Request& request);

// About what a search of all boxes in memory takes, in bytes: boxes, filters, the library's own.
std::uint64_t bytes_in_memory(const Request& request);

// Throws Failure for a world below -1; `first` is the index of worlds[0] in its file.
void check_worlds(const std::int32_t* worlds, std::size_t count, std::size_t first,
                  const std::string& path);
// Throws Failure unless the two have as many frames, or one of them one.
void check_frames(const std::string& a, std::size_t frames_a, const std::string& b,
                  std::size_t frames_b);

}  // namespace throng::stream
