// A worker: one task's staging room for pairs, and its scratch.
#pragma once

#include <cstdint>
#include <memory_resource>

#include "cpu/all_pairs.hpp"
#include "cpu/search.hpp"

namespace throng::cpu {

// Arrays of one column's boxes; see Strip.
class StripSpace {
 public:
  explicit StripSpace(Memory& memory) noexcept
      : order(memory), ranks(memory), words(memory), ids(memory), buckets(memory) {}
  // Points the arrays of `strip` at room for strip.count boxes; with_kinds: what a box asks as a
  // query is not what it tells as a target.
  void lay_out(Strip& strip, bool with_kinds);
  // Room for so many boxes, whatever is made of them.
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

// Staging rooms are small enough to stay in the first two levels of cache.
constexpr std::size_t staging_pairs = 2048;
constexpr std::size_t staging_maybe = 1024;

struct Level;
class GridSpace;

// One task's part of a binning.
struct BinTask : BinTarget {
  GridSpace* space = nullptr;
  unsigned task = 0;                           // its number
  std::uintptr_t next_free = 0, free_end = 0;  // blocks taken from the pool but not used yet
  std::uintptr_t dummy = 0;                    // where records go to die once the pool is short
};

class Worker : public Emit {
 public:
  explicit Worker(Memory& memory) noexcept;
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void begin(Search& search);
  // Decides and hands on everything staged.
  void drain();
  // At the end: gives back what room of the output it has left, too.
  void finish();
  // Whose pairs come from now on, until told otherwise: those of a search by words; or of brute
  // force, which knows of no kinds, no worlds and no doubles, and tells the labels of a frame.
  void by_words() { switch_to(Source::words, nullptr); }
  void by_brute_force(const Frame* frame) { switch_to(Source::brute_force, frame); }
  // Scratch of the grid at a depth: 0 is the whole problem's, 1 one of its columns' or worlds', ...
  static constexpr unsigned max_depth = 4;
  Level& level(unsigned depth);
  // As much room as another worker has: which columns a worker gets differs from call to call, and
  // a warm Finder must not need more for it.
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
  // Where pairs go straight into the output: the room that is being written, and one before it
  // whose end was too short to be written safely. Else pairs are staged.
  bool direct_ = false;
  // Of the pairs that are staged.
  bool ask_kinds_ = false, ask_worlds_ = false, ask_doubles_ = false;
  Room room_{}, gap_{};
};

}  // namespace throng::cpu
