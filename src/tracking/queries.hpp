// Queries against the objects: overlaps of boxes, and ray and shape casts (sweeps).
#pragma once

#include <cstdint>
#include <optional>

#include <throng/broad_phase.hpp>

#include "base/cancellation.hpp"
#include "base/per_thread.hpp"
#include "base/swept_box.hpp"
#include "grid/emit/pair_sink.hpp"
#include "grid/engine.hpp"
#include "grid/grid_query.hpp"
#include "tracking/bvh_forest.hpp"
#include "tracking/cells.hpp"
#include "tracking/objects.hpp"
#include "tracking/pod_vector.hpp"

namespace throng::tracking {

void load_filter(Filter& filter, const Filters& from, std::size_t i) noexcept;

// The grid columns of the last full search, and the objects that changed since.
struct Columns {
  grid::GridQuery grid_query;
  const PodVector<ObjectId>& changed;
};
// Where queries find objects: an up-to-date index (cells or forest), otherwise columns, otherwise a
// loop over all objects, also where that is cheaper than columns.
struct QueryIndex {
  const Cells* cells = nullptr;
  const BvhForest* forest = nullptr;
  const BlockOccupancy* blocks = nullptr;  // of these cells, if built
  std::optional<Columns> columns = {};

  // Estimated cost of a query (Box or base::MovingBox) without an index, in ns.
  template <class Query>
  double cost(const Objects& objects, const Query& query) const noexcept;
  template <class Query>
  bool columns_pay(const Objects& objects, const Query& query) const noexcept;
};

// Sweeps, the hits to report, and the filters of their boxes.
struct Sweeps {
  const Sweep* data;
  std::size_t count;
  SweepHits which;
  Filters filters;
  SweepTest test;
};

// One sweep, and what it may hit first.
struct Cast {
  const base::MovingBox& path;
  double last_time;  // at most 1; later hits do not count
  Filter filter;
  SweepTest test;
};
// The first hit; its object is `none` if there is none. Allocates nothing.
SweepHit find_first_hit(const Objects& objects, const QueryIndex& query_index, const Cast& cast,
                        Work& work) noexcept;

class Queries {
 public:
  // Uses the engine's memory; the engine also runs very large queries.
  explicit Queries(grid::Engine& engine) noexcept;

  grid::Engine& engine() noexcept { return engine_; }
  PodVector<Pair>& overlaps() noexcept { return overlaps_; }
  const PodVector<SweepHit>& hits() const noexcept { return hits_; }
  void clear_hits() noexcept { hits_.clear(); }

  // Throw base::AllocationFailed. Once `stop` is set, the remaining queries are skipped.
  Work find_overlaps(const Objects& objects, const QueryIndex& query_index, const Boxes& boxes,
                     const Executor& executor, unsigned tasks, base::Cancellation& stop);
  Work find_hits(const Objects& objects, const QueryIndex& query_index, const Sweeps& sweeps,
                 const Executor& executor, unsigned tasks, base::Cancellation& stop);

 private:
  template <class Run>
  Work run(std::size_t count, std::size_t limit, const Executor& executor, unsigned tasks,
           base::Cancellation& stop, const Run& run_one);

  grid::Engine& engine_;
  // Results and work of a task.
  struct Found {
    explicit Found(base::Memory& memory) noexcept : hits(memory) {}
    void match(const Found& other) { hits.match(other.hits); }

    PodVector<SweepHit> hits;
    Work work;
  };
  base::PerThread<Found> found_;
  PodVector<Pair> overlaps_;
  PodVector<SweepHit> hits_;
};

}  // namespace throng::tracking
