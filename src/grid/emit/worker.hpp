// A worker: one task's staging buffers for pairs, and its scratch.
#pragma once

#include <cstdint>

#include <throng/memory_resource.hpp>

#include "grid/all_pairs.hpp"
#include "grid/search.hpp"

namespace throng::grid {

// Staging buffers fit the L1 and L2 caches.
constexpr std::size_t staging_pairs = 2048;
constexpr std::size_t staging_ties = 1024;

struct RecursionScratch;
class BinnedGrid;

// One task's part of a binning.
struct BinTask final : RecordOutput {
  std::uintptr_t next_block(std::uint32_t column) override;

  BinnedGrid* grid = nullptr;
  unsigned task = 0;                           // its index
  std::uintptr_t next_free = 0, free_end = 0;  // blocks taken from the pool but not used yet
  std::uintptr_t dummy = 0;                    // target of records once the pool is exhausted
};

class Worker final : public PairOutput {
 public:
  explicit Worker(base::Memory& memory) noexcept;
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void begin(Search& search);
  // Passes confirmed pairs on.
  void flush() override;
  // Decides the ties by the input floats.
  void flush_ties() override;
  // Decides all ties and passes on everything staged.
  void drain();
  // At the end: also returns what is left of its output range.
  void finish();
  // The source of the pairs that follow: a sweep; or brute force, which ignores filter classes,
  // worlds and doubles, and reports labels of a parent.
  void use_sweep() { switch_to(Source::sweep, nullptr); }
  void use_brute_force(const ParentCell* parent) { switch_to(Source::brute_force, parent); }
  // Scratch of the grid at a depth: 0 is the full problem's, 1 one of its columns' or worlds', ...
  static constexpr unsigned max_depth = RejectMask::max_levels;
  RecursionScratch& scratch(unsigned depth);
  // Reserves what `other` has: which columns a worker gets differs from call to call, and a warmed
  // Finder must not allocate for that.
  void match(const Worker& other);

  BinTask bin;
  base::Buffer<char> dummy_block, bin_buffers;
  BoxTiles query_floats, target_floats;

 private:
  enum class Source : bool { sweep, brute_force };
  void switch_to(Source source, const ParentCell* parent);
  void set_source(Source source, const ParentCell* parent);
  void start_staging() noexcept;
  void write_directly();
  void next_range();
  std::size_t resolve_labels(Pair* pairs, std::size_t count) const noexcept;
  std::size_t filter(Pair* pairs, std::size_t count) const noexcept;

  base::Memory* memory_;
  Search* search_ = nullptr;
  Source source_ = Source::sweep;
  const ParentCell* parent_ = nullptr;
  RecursionScratch* scratch_[max_depth + 1] = {};  // the last for brute force in the innermost grid
  base::Buffer<Pair> confirmed_, ties_;
  // Direct output: the range being written, and an earlier one whose rest was too short to write
  // safely. Otherwise pairs are staged.
  bool direct_ = false;
  // Filters to apply to staged pairs.
  bool check_classes_ = false, check_worlds_ = false, check_doubles_ = false;
  OutputRange range_{}, gap_{};
};

}  // namespace throng::grid
