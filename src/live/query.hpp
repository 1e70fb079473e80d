// Questions to the objects: what overlaps a box, what is in a box's way.
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

// Columns in which all objects are but those that changed since, which are listed.
struct Columns {
  cpu::GridLook look;
  const List<ObjectId>& changed;
};
// Where queries look for objects: in cells or in a forest, in which all are where they belong, or
// in columns; and where there are none, or columns do not pay, at all objects.
struct Ground {
  const Cells* cells = nullptr;
  const BvhForest* forest = nullptr;
  const Blocks* blocks = nullptr;  // of these cells, once they are made
  std::optional<Columns> columns = {};

  // What a question costs without cells, in ns.
  double cost(const Objects& objects, const Box& box) const noexcept;
  double cost(const Objects& objects, const Sweep& sweep) const noexcept;
};

// Sweeps, and what is wanted of them; with the filters as those of their boxes.
struct Sweeps {
  const Sweep* data;
  std::size_t count;
  SweepHits which;
  Filters filters;
  SweepTest test;
};

class Queries {
 public:
  // In the engine's memory; very many boxes it searches itself.
  explicit Queries(cpu::Engine& engine) noexcept;

  cpu::Engine& engine() noexcept { return engine_; }
  List<Pair>& overlaps() noexcept { return overlaps_; }
  const List<SweepHit>& hits() const noexcept { return hits_; }
  void forget_hits() noexcept { hits_.clear(); }

  // Throw cpu::NoMemory. Once `stop` is true the questions that are left are not asked.
  Work find_overlaps(const Objects& objects, const Ground& ground, const Boxes& boxes,
                     const Executor& executor, unsigned tasks, cpu::Stop& stop);
  // `far` becomes CellWalk::looked_far() of all sweeps.
  Work find_hits(const Objects& objects, const Ground& ground, const Sweeps& sweeps,
                 const Executor& executor, unsigned tasks, cpu::Stop& stop, std::uint64_t& far);

 private:
  struct Look;
  struct Way;
  template <class Look, class Prepare, class Ask>
  Work run(std::size_t count, std::size_t limit, const Executor& executor, unsigned tasks,
           cpu::Stop& stop, Prepare&& prepare, Ask&& ask);

  cpu::Engine& engine_;
  // What a task finds, and what it looks at for that.
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
