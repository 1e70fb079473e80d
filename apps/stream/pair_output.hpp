// Collects the pairs of a streamed search: counts them, sums them up, writes them as they come or
// sorted on disk.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "apps/scenes/npy.hpp"
#include "apps/stream/scratch.hpp"

namespace throng::stream {

struct PairTotals {
  std::uint64_t count = 0, checksum = 0;
};

class PairOutput {
 public:
  // `run_keys`: the number of pairs sorted in memory at a time; 0: unsorted output.
  PairOutput(const std::string& path, std::size_t run_keys, Scratch& scratch);
  ~PairOutput();

  // Thread-safe.
  void write(const Pair* pairs, std::size_t count);

  // A failed search is repeated in parts. rewind() drops its pairs: written ones are truncated;
  // sorted ones stay, as the merge removes duplicates.
  struct Mark {
    std::uint64_t written = 0;
    PairTotals totals;
  };
  Mark mark() const noexcept;
  void rewind(const Mark& mark);

  // Ends a frame: sorts its pairs, if requested. Returns its totals.
  PairTotals finish_frame();
  // Completes the file.
  void finish();
  double order_ms() const noexcept { return order_ms_; }

 private:
  void deliver(const Pair* pairs, std::size_t count);
  void spill();
  template <class Take>
  void merge(std::vector<Part>& runs, const Take& take);

  std::string path_;
  Scratch& scratch_;
  std::unique_ptr<scenes::PairWriter> writer_;
  std::mutex mutex_;
  PairTotals totals_;
  std::vector<std::uint64_t> keys_;  // first << 32 | second
  std::size_t key_count_ = 0;
  std::vector<char> waiting_;  // buffer for an extent of a run
  std::vector<Part> runs_;
  double order_ms_ = 0;
};

}  // namespace throng::stream
