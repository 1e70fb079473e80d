// A grid alone: boxes binned by several tasks, then searched.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "base/per_thread.hpp"
#include "base/threads.hpp"
#include "grid/bin/grid.hpp"
#include "grid/emit/worker.hpp"
#include "grid/plan/make_plan.hpp"
#include "grid/steps.hpp"
#include "support/hard_boxes.hpp"

namespace throng::grid {

class SearchedGrid {
 public:
  struct How {
    unsigned tasks = 1;
    float cell_scale = 1;
    Isa isa = Isa::automatic;
    double stream_bytes = base::cost.stream_bytes;
  };
  // One set or, with `others`, two.
  SearchedGrid(const tests::BoxList& boxes, const tests::BoxList& others, How how)
      : view_(boxes), others_(others), grid_(memory_), workers_(memory_) {
    Search search;
    search.two_sets = !others.empty();
    search.a = &view_;
    search.b = search.two_sets ? &others_ : &view_;
    search.kernels = find_kernels(how.isa);
    search.executor = &base::default_executor();
    search.memory = &memory_;
    search.cell_scale = how.cell_scale;
    search.stream_bytes = how.stream_bytes;
    Problem problem;
    problem.queries = {&view_, nullptr, static_cast<std::uint32_t>(boxes.size())};
    problem.targets = {&others_, nullptr, static_cast<std::uint32_t>(others.size())};
    problem.self = !search.two_sets;
    plan_ = make_plan(search, problem, Algorithm::grid);
    Worker* const* const workers = workers_.make(how.tasks);
    const auto begin = [&] {
      for (unsigned t = 0; t < how.tasks; ++t) workers[t]->begin(search);
    };
    begin();
    const Job job{search, problem, plan_, {workers, how.tasks}};
    inactive_ = bin(job, grid_).inactive;
    std::vector<Pair> spill;
    for (bool fits = false; !fits;) {
      spill.resize(BufferSink::spill_for(how.tasks, pairs_.size()));
      BufferSink sink(pairs_.data(), pairs_.size(), spill.data(), spill.size());
      search.sink = &sink;
      begin();
      sweep(job, grid_);
      for (unsigned t = 0; t < how.tasks; ++t) workers[t]->finish();
      sink.close();
      fits = sink.found() <= pairs_.size();
      pairs_.resize(static_cast<std::size_t>(sink.found()));
    }
    buffered_ = workers[0]->bin_buffers.capacity() != 0;
    EXPECT_FALSE(search.failed());
  }
  explicit SearchedGrid(const tests::BoxList& boxes, How how) : SearchedGrid(boxes, {}, how) {}

  const BinnedGrid& grid() const { return grid_; }
  const GridPlan& plan() const { return plan_; }
  std::uint64_t inactive() const { return inactive_; }
  // Whether records were written through buffers.
  bool buffered() const { return buffered_; }
  std::vector<Pair> sorted_pairs() const {
    std::vector<Pair> sorted = pairs_;
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }

 private:
  base::Memory memory_{std::pmr::new_delete_resource(), 0};
  Boxes view_, others_;
  BinnedGrid grid_;
  base::PerThread<Worker> workers_;
  GridPlan plan_;
  std::uint64_t inactive_ = 0;
  bool buffered_ = false;
  std::vector<Pair> pairs_;
};

}  // namespace throng::grid
