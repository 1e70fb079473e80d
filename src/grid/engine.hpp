// The CPU backend: one call from boxes to pairs, and the memory kept between calls.
#pragma once

#include <array>
#include <cstdint>

#include <throng/finder.hpp>
#include <throng/options.hpp>

#include "base/cost_table.hpp"
#include "base/memory.hpp"
#include "base/output.hpp"
#include "base/per_thread.hpp"
#include "base/threads.hpp"
#include "grid/bin/filter_classes.hpp"
#include "grid/bin/grid.hpp"
#include "grid/emit/worker.hpp"
#include "grid/order/pair_sorter.hpp"
#include "grid/plan/filter_partition.hpp"

namespace throng::grid {

// The number of threads for so many boxes: of few, a second thread costs more than it gains.
template <class AnyOptions>
unsigned threads_for(std::uint64_t boxes, const AnyOptions& options) {
  return static_cast<double>(boxes) < base::cost.threads_boxes ? 1 : base::threads_of(options);
}

// A small number of pairs for any number of boxes: half a MiB.
constexpr std::size_t few_pairs = std::size_t{1} << 16;

// Capacity to allocate when `capacity` pairs fit and `count` are needed: some spare, so that frames
// that differ little do not each reallocate; more spare after a first allocation. Untouched memory
// costs nothing.
constexpr std::size_t with_spare(std::size_t count, std::size_t capacity) noexcept {
  return count + count / (capacity == 0 ? 64 : 8) + 512;
}
// Output::grow for a Buffer: null if allocation fails.
inline Pair* grow_pairs(void* buffer, std::size_t count) noexcept {
  auto& pairs = *static_cast<base::Buffer<Pair>*>(buffer);
  try {
    return count <= pairs.capacity() ? pairs.data()
                                     : pairs.ensure(with_spare(count, pairs.capacity()), true);
  } catch (...) {
    return nullptr;
  }
}

using base::Output;

class Engine {
 public:
  // `already_held`: bytes that the owner took from `memory` for the engine itself.
  Engine(std::pmr::memory_resource* memory, std::size_t already_held) noexcept;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // Arguments are validated by the API layer. b null: one set. `output` or `consumer` is null.
  Result find(const Boxes& a, const Boxes* b, const Options&, Output* output,
              const Consumer* consumer, PairTest* pair_test = nullptr);
  Result find(const DoubleBoxes& a, const DoubleBoxes* b, const Options&, Output* output,
              const Consumer* consumer);

  // A cap that suffices for a search of so many boxes, estimated without its plan.
  std::size_t sufficient_bytes(const Options&, std::uint64_t boxes, bool has_worlds) const noexcept;

  base::Memory& memory() noexcept { return memory_; }
  base::Buffer<Pair>& pairs() noexcept { return pairs_; }
  // The plan of the last call's single grid; null if there was none: brute force, or one problem
  // per world.
  const GridPlan* single_grid_plan() const noexcept {
    return has_grid_ && grid_plan_.worlds == 1 ? &grid_plan_ : nullptr;
  }
  const BinnedGrid& grid() const noexcept { return grid_; }
  // The prices of brute force and of the cheapest grid along each axis. For one problem; filters
  // are ignored.
  std::array<Candidate, 4> candidates(const Boxes& a, const Boxes* b, const Options&) const;
  // Calls report(what, bytes) for each part of the held memory.
  template <class Report>
  void report_memory(const Report& report) const {
    const std::size_t cells = grid_.held(), sorting = sorter_.held();
    const std::size_t pairs = pairs_.bytes() + unordered_.bytes() + ordered_.bytes();
    report("boxes in cells", cells);
    report("pairs", pairs);
    report("sorting pairs", sorting);
    report("per-thread scratch and other", memory_.held() - cells - sorting - pairs);
  }
  // After a call with status nan_box: whether first_invalid refers to the second set.
  bool nan_in_second_set() const noexcept { return nan_in_b_; }

 private:
  struct Call;
  Result find(Call&, const Boxes& a, const Boxes* b, Output*, const Consumer*);
  void round(Call&);
  Job job_of(Call&);
  void prepare(Call&);
  void pass(Call&, Sink&);
  void reserve_output(Call&, Output&);
  void find_into(Call&, Output&);
  void find_sorted(Call&, Output&);
  void consume(Call&, const Consumer&);
  void consume_sorted(Call&, const Consumer&);
  void grow_pair_buffers(const Call&);
  void consume_range(Call&, const Consumer&, std::uint64_t begin, unsigned slice_bits, bool& go_on);
  void solve_partition(Call&);
  std::size_t sufficient_bytes(const Call&) const noexcept;
  std::size_t sufficient_bytes(const Call&, std::uint64_t boxes) const noexcept;

  base::Memory memory_;
  base::Buffer<Box> rounded_;  // float boxes in place of doubles
  FilterClasses filter_classes_;
  BinnedGrid grid_;
  FilterPartition partition_;
  PairSorter sorter_;
  base::Buffer<Pair> spill_;  // see BufferSink
  base::Buffer<Pair> pairs_, unordered_, ordered_;
  GridPlan grid_plan_;
  bool has_grid_ = false;
  bool nan_in_b_ = false;
  base::PerThread<Worker> workers_;
};

}  // namespace throng::grid
