// Splits a problem by world and static where that is cheaper (filter_planning.hpp): none of the
// parts compares boxes that never pair.
#pragma once

#include <cstdint>

#include "grid/search.hpp"

namespace throng::grid {

class Worker;

class FilterPartition {
 public:
  explicit FilterPartition(base::Memory& memory) noexcept
      : a_(memory), b_(memory), problems_(memory) {}

  // Splits the boxes of the search's set (or sets) by static and by world. Counts the inactive
  // ones, which are in no problem.
  void split(const Search& search, BinReport& report);

  std::uint32_t problem_count() const noexcept { return problem_count_; }
  const Problem& problem(std::uint32_t i) const noexcept { return problems_[i]; }

  // Estimates the pairs of all problems; see estimate_pair_count.hpp.
  std::size_t estimate_pair_count(Search& search, Algorithm algorithm, Worker& worker) const;

 private:
  // Ids of active boxes: the movers by world, then the static ones by world; -1 is the first world.
  struct Sorted {
    explicit Sorted(base::Memory& memory) noexcept : ids(memory), runs(memory), slots(memory) {}
    struct Run {  // the moving or the static boxes of one world
      std::int32_t world;
      std::uint32_t begin, count;
    };
    // The runs of moving or static boxes from `first_run` on, of worlds >= 0; that of world -1
    // separate.
    struct MotionGroup {
      Run in_all_worlds{-1, 0, 0};
      std::uint32_t first_run = 0, run_count = 0;
      std::uint32_t begin = 0, count = 0;  // of all boxes in them
    };
    base::Buffer<std::uint32_t> ids;
    base::Buffer<Run> runs;
    base::Buffer<std::uint64_t> slots;
    MotionGroup motion_groups[2];  // movers, static
    const Boxes* boxes = nullptr;

    BoxSubset side(const Run& run) const noexcept {
      return {boxes, ids.data() + run.begin, run.count};
    }
    BoxSubset all(const MotionGroup& group) const noexcept {
      return {boxes, ids.data() + group.begin, group.count};
    }
    BoxSubset all_and_in_all_worlds(const MotionGroup& group) const noexcept {
      return {boxes, ids.data() + group.in_all_worlds.begin,
              group.in_all_worlds.count + group.count};
    }
  };
  static void sort(const Boxes&, bool is_second, Sorted&, BinReport&);
  void add(const BoxSubset& queries, const BoxSubset& targets, bool self);
  // Pairs up runs of the same world: self pairs of `a` if `self`, and cross pairs.
  void add_same_worlds(const Sorted& a, unsigned group_a, const Sorted& b, unsigned group_b,
                       bool self);
  void add_one_set();
  void two_sets();

  Sorted a_, b_;
  base::Buffer<Problem> problems_;
  std::uint32_t problem_count_ = 0;
};

}  // namespace throng::grid
