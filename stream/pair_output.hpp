// Where the pairs of a streamed search go: counted, summed up, written as they come or sorted on
// the disk.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "scene/npy.hpp"
#include "stream/scratch.hpp"

namespace throng::stream {

struct PairTotals {
  std::uint64_t count = 0, checksum = 0;
};

class PairOutput {
 public:
  // `run_keys`: so many pairs are sorted in memory at a time; 0: pairs go out in any order.
  PairOutput(const std::string& path, std::size_t run_keys, Scratch& scratch);
  ~PairOutput();

  // From any thread.
  void write(const Pair* pairs, std::size_t count);

  // A search that fails halfway is made again in parts. Whatever it told is taken back: written
  // pairs are cut off; sorted ones stay, and those that come twice go when runs are merged.
  struct Mark {
    std::uint64_t written = 0;
    PairTotals totals;
  };
  Mark mark() const noexcept;
  void take_back(const Mark& mark);

  // The frame's pairs are all there: sorts them, where asked for. What they are.
  PairTotals finish_frame();
  // The file takes its name.
  void finish();
  double order_ms() const noexcept { return order_ms_; }

 private:
  void deliver(const Pair* pairs, std::size_t count);
  void spill();
  template <class Take>
  void merge(std::vector<Part>& runs, const Take& take);

  std::string path_;
  Scratch& scratch_;
  std::unique_ptr<scene::PairWriter> writer_;
  std::mutex mutex_;
  PairTotals totals_;
  std::vector<std::uint64_t> keys_;  // first << 32 | second
  std::size_t key_count_ = 0;
  std::vector<char> waiting_;  // for an extent of a run
  std::vector<Part> runs_;
  double order_ms_ = 0;
};

}  // namespace throng::stream
