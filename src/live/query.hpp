// Queries against the objects: overlaps of boxes, and ray and shape casts (sweeps).
#pragma once

#include <cstdint>
#include <optional>

#include <throng/broad_phase.hpp>

#include "core/sweep.hpp"
#include "cpu/each_task.hpp"
#include "cpu/engine.hpp"
#include "cpu/grid_look.hpp"
#include "cpu/sink.hpp"
#include "cpu/stop.hpp"
#include "live/bvh_forest.hpp"
#include "live/cells.hpp"
#include "live/list.hpp"
#include "live/objects.hpp"

namespace throng::live {

void set(Filter& filter, const Filters& from, std::size_t i) noexcept;

// The grid columns of the last full search, and the objects that changed since.
struct Columns {
  cpu::GridLook look;
  const List<ObjectId>& changed;
};
// Where queries find objects: an up-to-date index (cells or forest), otherwise columns, otherwise a
// loop over all objects, also where that is cheaper than columns.
struct Ground {
  const Cells* cells = nullptr;
  const BvhForest* forest = nullptr;
  const Blocks* blocks = nullptr;  // of these cells, if built
  std::optional<Columns> columns = {};

  // Estimated cost of a query without an index, in ns.
  double cost(const Objects& objects, const Box& box) const noexcept;
  double cost(const Objects& objects, const Sweep& sweep) const noexcept;
};

// Sweeps, the hits to report, and the filters of their boxes.
struct Sweeps {
  const Sweep* data;
  std::size_t count;
  SweepHits which;
  Filters filters;
  SweepTest test;
};

class Queries {
 public:
  // Uses the engine's memory; the engine also runs very large queries.
  explicit Queries(cpu::Engine& engine) noexcept;

  cpu::Engine& engine() noexcept { return engine_; }
  List<Pair>& overlaps() noexcept { return overlaps_; }
  const List<SweepHit>& hits() const noexcept { return hits_; }
  void forget_hits() noexcept { hits_.clear(); }

  // Throw cpu::NoMemory. Once `stop` is set, the remaining queries are skipped.
  Work find_overlaps(const Objects& objects, const Ground& ground, const Boxes& boxes,
                     const Executor& executor, unsigned tasks, cpu::Stop& stop);
  // `far`: the sum of CellWalk::looked_far() of all sweeps.
  Work find_hits(const Objects& objects, const Ground& ground, const Sweeps& sweeps,
                 const Executor& executor, unsigned tasks, cpu::Stop& stop, std::uint64_t& far);

 private:
  struct Look;
  struct Way;
  template <class Look, class Prepare, class Ask>
  Work run(std::size_t count, std::size_t limit, const Executor& executor, unsigned tasks,
           cpu::Stop& stop, Prepare&& prepare, Ask&& ask);

  cpu::Engine& engine_;
  // Results and work of a task.
  struct Found {
    explicit Found(cpu::Memory& memory) noexcept : hits(memory) {}
    void match(const Found& other) { hits.match(other.hits); }

    List<SweepHit> hits;
    Work work;
  };
  cpu::EachTask<Found> found_;
  List<Pair> overlaps_;
  List<SweepHit> hits_;
};

}  // namespace throng::live
