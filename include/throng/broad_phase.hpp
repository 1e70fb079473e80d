// BroadPhase: objects that live. It keeps them from frame to frame, and tells which pairs began and
// which ended.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/finder.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

using ObjectId = std::uint32_t;

// What one object pairs with. See Filters, which holds the same by arrays.
struct Filter {
  std::uint32_t group = 0xffffffffu, mask = 0xffffffffu;
  std::int32_t owner = -1, world = -1;
  std::uint8_t is_static = 0;
};

// first < second. The slot is the pair's own for as long as it lives: a place for what an engine
// keeps of it, as contacts. Slots are small numbers: at most as many as pairs that lived in two
// updates that followed one another.
struct LivePair {
  ObjectId first, second;
  std::uint32_t slot;
};

// A view of pairs that a BroadPhase owns, sorted by first, then second.
struct LivePairs {
  const LivePair* data_ = nullptr;
  std::size_t size_ = 0;

  const LivePair* data() const noexcept { return data_; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  const LivePair* begin() const noexcept { return data_; }
  const LivePair* end() const noexcept { return data_ + size_; }
  const LivePair& operator[](std::size_t i) const noexcept { return data_[i]; }
};

// A box that goes straight by `by` in the time from 0 to 1. A ray is a point that does.
struct Sweep {
  Box box;
  Vec3 by;
};
// Of sweep number `sweep`: when it first touches the object.
struct SweepHit {
  std::uint32_t sweep;
  ObjectId object;
  double time;  // 0: it does from the start
};
enum class SweepHits : std::uint8_t {
  all,    // every object on the way, by id
  first,  // the one that is met first; of several at once that of the lowest id
};
// Whether a sweep meets the object itself, of whose box it is known: asked of each object whose box
// it meets at `time`, unless that plays no part any more. The answer is when it meets the object;
// that is taken as `time` if it is earlier, and as never if it is above 1, or NaN. So the first hit
// can be that of the shapes, or leave out whom the ray came from. It may be asked several times of
// an object, in any order, and on any thread that finds hits; it must say the same each time, and
// must not throw, nor call the BroadPhase or the BroadPhaseQuery that asks. A question with a test
// is not captured.
struct SweepTest {
  double (*when)(void* context, std::uint32_t sweep, ObjectId object, double time) = nullptr;
  void* context = nullptr;
};
// A view of hits that a BroadPhase or a BroadPhaseQuery owns, sorted by sweep.
struct SweepHitList {
  const SweepHit* data_ = nullptr;
  std::size_t size_ = 0;

  const SweepHit* data() const noexcept { return data_; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  const SweepHit* begin() const noexcept { return data_; }
  const SweepHit* end() const noexcept { return data_ + size_; }
  const SweepHit& operator[](std::size_t i) const noexcept { return data_[i]; }
};

// Objects are added, moved and removed; update() then tells what this did to the pairs. What it
// tells is what two double loops would differ by, before and after. The cost follows the objects
// that changed, and where many did, the cost of finding all pairs anew.
//
// A call that fails changes nothing: not the objects, not what was told. One thread at a time; a
// call during another one is refused with Status::busy. Several threads ask at once by a
// BroadPhaseQuery each, while nothing else is called. Result::found of a call on objects is how
// many there are then, of update() how many pairs live.
//
// Of Options these hold here: nan, inverted, isa, margin, threads, measure_stages, capture,
// executor, memory and stop, the last three of which must outlive the object; backend must be
// automatic or cpu. `stop` is heeded by update() and by questions, which then have changed nothing:
// Status::stopped.
class THRONG_API BroadPhase {
 public:
  BroadPhase() noexcept = default;
  explicit BroadPhase(const Options& options) noexcept : options_(options) {}
  ~BroadPhase();
  // A snapshot: ids, slots and what the last update told are the same. Throws Error.
  BroadPhase(const BroadPhase& other);
  BroadPhase& operator=(const BroadPhase& other);
  BroadPhase(BroadPhase&& other) noexcept;
  BroadPhase& operator=(BroadPhase&& other) noexcept;
  // The same, reporting through a Result. What this held is lost if it succeeds; it keeps its own
  // options, but for the margin. It allocates nothing where it has held as much before.
  Result copy_from(const BroadPhase& other) noexcept;

  // Adds an object for each box, with the filters that hang on the view, and writes their ids:
  // 0, 1, 2, ... where none was removed. The id of a removed object is given away again only after
  // an update has told which pairs its removal ended.
  // Cost: a constant for each; the search is the next update's or query's. All calls:
  // docs/choosing.md.
  Result add(const Boxes& boxes, ObjectId* ids) noexcept;
  Status add(const Box& box, const Filter& filter, ObjectId& id) noexcept;
  ObjectId add(const Box& box, const Filter& filter = {});  // throws Error

  // An id that is not alive, or twice in one list, is an error: Status::bad_id.
  // Cost: as add.
  Result remove(const ObjectId* ids, std::size_t count) noexcept;
  Status remove(ObjectId id) noexcept;

  // Gives objects new boxes; of several calls before an update the last wins. Filters that hang on
  // the view are not looked at. The list is taken whole or not at all: a box with a NaN refuses it,
  // Result::first_invalid is that box's place in the list; NanPolicy::inactive takes such a box.
  // Cost: as add.
  Result move(const ObjectId* ids, const Boxes& boxes) noexcept;
  Status move(ObjectId id, const Box& box) noexcept;
  // The same for all objects: boxes[id] for every id below id_limit(). It finds out which boxes
  // differ. Those of ids that are not alive are not looked at.
  // Cost: a look at each object; then as move() of those that differ.
  Result move_all(const Boxes& boxes) noexcept;

  // One value an object of the list; filters that are absent stay as they were.
  // Cost: as add.
  Result set_filters(const ObjectId* ids, std::size_t count, const Filters& filters) noexcept;
  Status set_filter(ObjectId id, const Filter& filter) noexcept;

  // Adds `by` to all corners, rounded to nearest. The next update tells the pairs of the boxes that
  // this gives: rounding can make boxes touch that did not, and the reverse. Active boxes stay
  // active and inactive ones inactive: where rounding would make lower and upper one number, upper
  // goes a float further down. `by` is finite.
  // Cost: as move() of all objects.
  Result shift_origin(const Vec3& by) noexcept;

  // Finds the pairs that began and ended since the last update.
  // Cost: for each object that changed log n + its pairs; at most n + all pairs.
  Result update() noexcept;
  // What the last update told; good until the next one. A slot that ended is free: the next update
  // may give it to another pair.
  LivePairs begun() const noexcept;
  LivePairs ended() const noexcept;
  // All pairs there are since the last update; good until the next. They are put into order when
  // they are asked for.
  // Cost: a sort of all pairs, once after an update.
  LivePairs pairs() noexcept;
  // Those of one object, sorted by the other one. Returns how many there are, and writes them if
  // `room` is enough; if not, what is in `out` then is of no use. 0 of an id that has none. It
  // costs what the object's own pairs do; only after an update that found all pairs anew the first
  // calls look through all of them. Several threads may call it at once, and beside each
  // BroadPhaseQuery.
  // Cost: the object's pairs; see above.
  std::size_t pairs_of(ObjectId id, LivePair* out, std::size_t room) const noexcept;

  // Questions to the objects as they were given last, with an update since or without. Each takes
  // many at once and shares them out among threads. The margin plays no part. What they find is
  // good until the next question, and gone if that fails.
  //
  // All objects that each box overlaps, as far as the filters on the view allow: first is the
  // number of the box, second the object; sorted. The Result tells how many.
  // Cost: for each box log n + what it overlaps.
  Result find_overlaps(const Boxes& boxes) noexcept;
  Pairs overlaps() const noexcept;
  // The objects that each sweep meets. On each axis the times of touching are computed in doubles,
  //   (object.lower - box.upper) / by  ..  (object.upper - box.lower) / by,
  // and cut to 0 .. 1; along an axis with `by` 0 the boxes must overlap. What is the hit is decided
  // by these numbers alone, and by `test` if there is one. Where an infinite bound meets an equal
  // one, so that the difference is infinity minus infinity, that time is no limit: on that axis the
  // two are at the same place from the start. So a swept box with upper +infinity meets an object
  // with lower +infinity at 0, if the other axes allow it.
  // A sweep with a NaN, or a `by` that is not finite, is refused: nan_box. A ray without a limit is
  // one that is longer than the scene; any component up to 3.4e38 is taken, and times are shares of
  // that length. A box with lower > upper meets nothing.
  // Cost: for each sweep log n + what it meets, and of a long one what lies along its way.
  Result find_hits(const Sweep* sweeps, std::size_t count, SweepHits which = SweepHits::all,
                   const Filters& filters = {}, const SweepTest& test = {}) noexcept;
  SweepHitList hits() const noexcept;

  bool is_alive(ObjectId id) const noexcept;
  // As they were given last. The id must be alive.
  Box box(ObjectId id) const noexcept;
  Filter filter(ObjectId id) const noexcept;
  std::uint64_t object_count() const noexcept;
  std::uint64_t pair_count() const noexcept;
  // All ids are below this.
  std::uint64_t id_limit() const noexcept;
  // All slots of pairs that live, or ended in the last update, are below this.
  std::uint64_t slot_limit() const noexcept;

  const Options& options() const noexcept { return options_; }
  // Bytes that the object holds now.
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  friend struct BroadPhaseAccess;
  State* state_ = nullptr;
  Options options_;
};

}  // namespace throng
