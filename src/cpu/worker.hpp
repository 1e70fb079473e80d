// A worker: one task's staging buffers for pairs, and its scratch.
#pragma once

#include <cstdint>
#include <memory_resource>

#include "cpu/all_pairs.hpp"
#include "cpu/search.hpp"

namespace throng::cpu {

// Storage of a Strip's arrays.
class StripSpace {
 public:
  explicit StripSpace(Memory& memory) noexcept
      : order(memory), ranks(memory), words(memory), ids(memory), buckets(memory) {}
  // Points the arrays of `strip` at storage for strip.count boxes. with_kinds: query and target
  // bits differ.
  void lay_out(Strip& strip, bool with_kinds);
  // Reserves for `count` boxes.
  void reserve(std::uint32_t count, bool with_kinds);
  void match(const StripSpace& other);

  Buffer<const Record*> order;
  Buffer<std::uint32_t> ranks;
  Buffer<std::int16_t> words;
  Buffer<std::uint32_t> ids;
  Buffer<std::uint32_t> buckets;
};

struct Segment {
  const Record* records;
  std::uint32_t count;
};

// Staging buffers fit the L1 and L2 caches.
constexpr std::size_t staging_pairs = 2048;
constexpr std::size_t staging_maybe = 1024;

struct Level;
class GridSpace;

// One task's part of a binning.
struct BinTask : BinTarget {
  GridSpace* space = nullptr;
  unsigned task = 0;                           // its index
  std::uintptr_t next_free = 0, free_end = 0;  // blocks taken from the pool but not used yet
  std::uintptr_t dummy = 0;                    // target of records once the pool is exhausted
};

class Worker : public Emit {
 public:
  explicit Worker(Memory& memory) noexcept;
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void begin(Search& search);
  // Decides all ties and passes on everything staged.
  void drain();
  // At the end: also returns what is left of its output range.
  void finish();
  // The source of the pairs that follow: a sweep; or brute force, which ignores filter classes,
  // worlds and doubles, and reports labels of a frame.
  void by_words() { switch_to(Source::words, nullptr); }
  void by_brute_force(const Frame* frame) { switch_to(Source::brute_force, frame); }
  // Scratch of the grid at a depth: 0 is the full problem's, 1 one of its columns' or worlds', ...
  static constexpr unsigned max_depth = 4;
  Level& level(unsigned depth);
  // Reserves what `other` has: which columns a worker gets differs from call to call, and a warmed
  // Finder must not allocate for that.
  void match(const Worker& other);

  BinTask bin;
  Buffer<char> dummy_block, bin_buffers;
  FloatSpace query_floats, target_floats;

 private:
  static void flush_sure(Emit* emit);
  static void flush_unsure(Emit* emit);
  enum class Source : bool { words, brute_force };
  void switch_to(Source source, const Frame* frame);
  void take_from(Source source, const Frame* frame);
  void stage() noexcept;
  void go_straight();
  void next_room();
  std::size_t leave_frame(Pair* pairs, std::size_t count) const noexcept;
  std::size_t filter(Pair* pairs, std::size_t count) const noexcept;

  Memory* memory_;
  Search* search_ = nullptr;
  Source source_ = Source::words;
  const Frame* frame_ = nullptr;
  Level* levels_[max_depth + 1] = {};  // the last for brute force in the innermost grid
  Buffer<Pair> sure_, unsure_;
  // Direct output: the range being written, and an earlier one whose rest was too short to write
  // safely. Otherwise pairs are staged.
  bool direct_ = false;
  // Filters to apply to staged pairs.
  bool ask_kinds_ = false, ask_worlds_ = false, ask_doubles_ = false;
  Room room_{}, gap_{};
};

}  // namespace throng::cpu
