// BroadPhase: persistent objects. It keeps them from frame to frame and reports which pairs began
// and ended.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/finder.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

using ObjectId = std::uint32_t;

// What one object pairs with. See Filters for the same values as arrays.
struct Filter {
  std::uint32_t group = 0xffffffffu, mask = 0xffffffffu;
  std::int32_t owner = -1, world = -1;
  std::uint8_t is_static = 0;
};

// first < second. The slot belongs to the pair for its lifetime, as an index for per-pair data such
// as contacts. Slots are small numbers: at most as many as there were pairs in any two consecutive
// updates.
struct LivePair {
  ObjectId first, second;
  std::uint32_t slot;
};

// A view of pairs that a BroadPhase owns, sorted by first, then second.
using LivePairs = ArrayView<LivePair>;

// A box that moves straight by `by` in the time from 0 to 1. A ray is a moving point.
struct Sweep {
  Box box;
  Vec3 by;
};
// A hit of sweep number `sweep`: the time at which it first touches the object.
struct SweepHit {
  std::uint32_t sweep;
  ObjectId object;
  double time;  // 0: touches from the start
};
enum class SweepHits : std::uint8_t {
  all,    // all objects hit, by id
  first,  // the earliest hit; among equal times the lowest id
};
// Optional exact test of a sweep against an object whose box it hits at `time`. Returns the time of
// the hit of the object itself; an earlier one counts as `time`, and one above 1 or NaN as no hit.
// So hits can be those of the exact shapes, or exclude the object that a ray starts from. Called
// only for objects that can still matter, possibly several times per object, in any order and on
// any thread that runs the query. It must be deterministic, must not throw, and must not call the
// BroadPhase or BroadPhaseQuery. Queries with a test are not captured.
//
// It is a reference: a callable must outlive the call. Two kinds of callables convert to it: the
// test, double(std::uint32_t sweep, ObjectId object, double time), and a filter, bool(ObjectId).
struct SweepTest {
  using Function = double (*)(void* context, std::uint32_t sweep, ObjectId object, double time);
  Function when = nullptr;
  void* context = nullptr;

  constexpr SweepTest() noexcept = default;
  constexpr SweepTest(Function function, void* its_context) noexcept
      : when(function), context(its_context) {}

  template <
      class F,
      std::enable_if_t<std::is_invocable_r_v<double, F&, std::uint32_t, ObjectId, double>, int> = 0>
  SweepTest(F&& f) noexcept  // NOLINT(google-explicit-constructor): a function reference
      : when([](void* callable, std::uint32_t sweep, ObjectId object, double time) -> double {
          return (*reinterpret_cast<std::remove_reference_t<F>*>(callable))(sweep, object, time);
        }),
        context(const_cast<void*>(reinterpret_cast<const void*>(&f))) {
    static_assert(!std::is_same_v<std::invoke_result_t<F&, std::uint32_t, ObjectId, double>, bool>,
                  "a test returns the time of the hit; a filter takes only the ObjectId");
  }
  template <class F, std::enable_if_t<std::is_invocable_r_v<bool, F&, ObjectId>, long> = 0>
  SweepTest(F&& f) noexcept  // NOLINT(google-explicit-constructor): a function reference
      : when([](void* callable, std::uint32_t, ObjectId object, double time) -> double {
          return (*reinterpret_cast<std::remove_reference_t<F>*>(callable))(object) ? time : 2;
        }),
        context(const_cast<void*>(reinterpret_cast<const void*>(&f))) {}
};
// A reference to a callable bool(ObjectId): whether a query may report the object. Without one, all
// are. The callable must outlive the call, be deterministic and not throw. It may call const
// functions of the BroadPhase. Queries with a filter are not captured.
class ObjectFilter {
 public:
  using Function = bool (*)(void* context, ObjectId object);
  constexpr ObjectFilter() noexcept = default;
  constexpr ObjectFilter(Function function, void* context) noexcept
      : function_(function), context_(context) {}

  template <class F, std::enable_if_t<!std::is_same_v<std::decay_t<F>, ObjectFilter> &&
                                          std::is_invocable_r_v<bool, F&, ObjectId>,
                                      int> = 0>
  ObjectFilter(F&& f) noexcept  // NOLINT(google-explicit-constructor): a function reference
      : function_([](void* context, ObjectId object) -> bool {
          return (*reinterpret_cast<std::remove_reference_t<F>*>(context))(object);
        }),
        context_(const_cast<void*>(reinterpret_cast<const void*>(&f))) {}

  explicit operator bool() const noexcept { return function_ != nullptr; }
  bool operator()(ObjectId object) const { return !function_ || function_(context_, object); }

 private:
  Function function_ = nullptr;
  void* context_ = nullptr;
};
// The closest hit of a ray: see BroadPhase::raycast.
struct RayHit {
  ObjectId object;
  double distance;  // world units; 0: the ray starts in the box
  Vec3 point;       // a point of the box
  Vec3 normal;      // of length 1: of the face that the ray enters
};
// A view of hits that a BroadPhase or a BroadPhaseQuery owns, sorted by sweep.
using SweepHitList = ArrayView<SweepHit>;

// Objects are added, moved and removed; update() then reports the change of the pairs. It equals
// the difference of two double loops, before and after. The cost depends on the number of objects
// that changed, up to that of finding all pairs from scratch.
//
// A call that fails changes nothing, neither objects nor reported events. One thread at a time: a
// call during another is refused with Status::busy. For concurrent queries use one BroadPhaseQuery
// per thread, while no other call runs. Result::found is the number of objects after a call on
// objects, and the number of pairs after update().
//
// Options that apply: nan, inverted, isa, margin, threads, measure_stages, capture, executor,
// memory and stop. The last three must outlive the object; backend must be automatic or cpu.
// update() and queries check `stop`; then they change nothing and return Status::stopped.
class THRONG_API BroadPhase {
 public:
  BroadPhase() noexcept = default;
  explicit BroadPhase(const Options& options) noexcept : options_(options) {}
  ~BroadPhase();
  // A snapshot: ids, slots and the events of the last update are equal. Throws Error.
  BroadPhase(const BroadPhase& other);
  BroadPhase& operator=(const BroadPhase& other);
  BroadPhase(BroadPhase&& other) noexcept;
  BroadPhase& operator=(BroadPhase&& other) noexcept;
  // The same, reporting through a Result. Replaces the contents on success; keeps its own options
  // except for the margin. Allocates nothing if it has held as much before.
  Result copy_from(const BroadPhase& other) noexcept;

  // Adds an object for each box, with the filters of the view, and writes the ids: 0, 1, 2, ... if
  // none was removed. The id of a removed object is reused only after an update has reported the
  // pairs that its removal ended.
  // Cost: constant per object; the search happens in the next update or query. All calls:
  // docs/how-to/choose.md.
  Result add(const Boxes& boxes, ObjectId* ids) noexcept;
  Status add(const Box& box, const Filter& filter, ObjectId& id) noexcept;
  ObjectId add(const Box& box, const Filter& filter = {});  // throws Error

  // An id that is not alive, or occurs twice in one list, is an error: Status::bad_id.
  // Cost: as add.
  Result remove(const ObjectId* ids, std::size_t count) noexcept;
  Status remove(ObjectId id) noexcept;

  // Sets the boxes of objects; the last of several calls before an update wins. Filters of the view
  // are ignored. All or nothing: a box with a NaN refuses the list, and Result::first_invalid is
  // its index in the list; NanPolicy::inactive accepts it.
  // Cost: as add.
  Result move(const ObjectId* ids, const Boxes& boxes) noexcept;
  Status move(ObjectId id, const Box& box) noexcept;
  // The same for all objects: boxes[id] for every id below id_limit(). Detects which boxes differ.
  // Boxes of ids that are not alive are ignored.
  // Cost: one comparison per object; then as move() of those that differ.
  Result move_all(const Boxes& boxes) noexcept;

  // One value per listed object; absent filters stay unchanged.
  // Cost: as add.
  Result set_filters(const ObjectId* ids, std::size_t count, const Filters& filters) noexcept;
  Status set_filter(ObjectId id, const Filter& filter) noexcept;

  // Adds `by`, which must be finite, to all corners, rounded to nearest. The next update reports
  // the pairs of the resulting boxes: rounding can create or remove contacts. Active boxes stay
  // active and inactive ones inactive: where rounding would make lower and upper equal, upper is
  // decreased by one float.
  // Cost: as move() of all objects.
  Result shift_origin(const Vec3& by) noexcept;

  // Finds the pairs that began and ended since the last update.
  // Cost: per changed object log n + its pairs; at most n + all pairs.
  Result update() noexcept;
  // Events of the last update; valid until the next one. The slot of an ended pair is free: the
  // next update may give it to another pair.
  LivePairs begun() const noexcept;
  LivePairs ended() const noexcept;
  // All pairs as of the last update; valid until the next one. Sorted on demand.
  // Cost: a sort of all pairs, once after an update.
  LivePairs pairs() noexcept;
  // The pairs of one object, sorted by the other one. Returns how many there are and writes them if
  // `capacity` is enough; otherwise the contents of `out` are unspecified. 0 for an id without
  // pairs. Thread-safe against itself and against each BroadPhaseQuery. Cost: the object's pairs;
  // but after an update that found all pairs from scratch, the first calls scan all pairs.
  std::size_t pairs_of(ObjectId id, LivePair* out, std::size_t capacity) const noexcept;

  // Queries against the current boxes of the objects; no update is needed first. Each call takes a
  // batch and divides it among threads. The margin is ignored. Results are valid until the next
  // query, and lost if that fails.
  //
  // All objects that each box overlaps, subject to the filters of the view: first is the index of
  // the box, second the object; sorted. The Result has their number.
  // Cost: per box log n + its overlaps.
  // `filter` is called once for each overlap, on the calling thread.
  Result find_overlaps(const Boxes& boxes, ObjectFilter filter = {}) noexcept;
  Pairs overlaps() const noexcept;
  // The objects that each sweep hits (ray cast, shape cast). On each axis the times of contact are
  // computed in doubles,
  //   (object.lower - box.upper) / by  ..  (object.upper - box.lower) / by,
  // and clamped to 0 .. 1; along an axis with `by` 0 the boxes must overlap. These numbers, and
  // `test` if given, alone decide a hit. Infinity minus infinity, from two equal infinite bounds,
  // sets no limit: on that axis both are at the same place from the start. So a swept box with
  // upper +infinity hits an object with lower +infinity at 0, if the other axes allow it.
  // A sweep with a NaN or a `by` that is not finite is refused: nan_box. For an unbounded ray, use
  // one longer than the scene; components up to 3.4e38 are accepted, and times are fractions of
  // that length. A box with lower > upper hits nothing.
  // Cost: per sweep log n + its hits; for a long sweep also what lies along its path.
  Result find_hits(const Sweep* sweeps, std::size_t count, SweepHits which = SweepHits::all,
                   const Filters& filters = {}, const SweepTest& test = {}) noexcept;
  SweepHitList hits() const noexcept;

  // The closest object that one ray hits within `max_distance`, which may be infinite; none: no
  // value. The direction may have any length. An object is considered if its group has a bit of
  // `layer_mask`, and `filter` allows it; its own mask must not be 0.
  //
  // For each axis on which the direction is not 0, these are computed in doubles:
  //   (object.lower - origin) / direction  ..  (object.upper - origin) / direction
  // For a negative direction they change places. On an axis on which the direction is 0, the origin
  // must be between lower and upper. The ray enters at t, the largest of 0 and the first numbers of
  // the axes. It hits if t is finite and no second number is below t. The distance is
  // t * |direction|. The closest hit is that of the smallest t, among equal ones that of the lowest
  // id. So touching counts, and max_distance itself is within reach.
  //
  // `normal` is that of the face that the ray enters; at an edge or corner that of the first axis.
  // On that axis `point` is exactly on the face; on the others it is origin + t * direction,
  // rounded and moved into the box. If the ray starts in the box, faces included, the distance is
  // 0, `point` is the origin and `normal` the opposite of the direction.
  //
  // Const and thread-safe: any number of threads may cast rays at once, also during calls on a
  // BroadPhaseQuery. During other calls it is refused with Status::busy, and those during a ray
  // cast. It stores no results and allocates nothing, but as any query it may build an index first.
  // It does not check Options::stop and is not captured. For many rays find_hits() is faster.
  // Throws Error: an origin or direction that is not finite, a direction of 0, a negative distance.
  // Cost: log n + what lies along the path, up to the hit.
  std::optional<RayHit> raycast(const Vec3& origin, const Vec3& direction,
                                double max_distance = std::numeric_limits<double>::infinity(),
                                std::uint32_t layer_mask = 0xffffffffu,
                                ObjectFilter filter = {}) const;
  // The same with all filter values of the ray, which work as for two objects, and reporting
  // through a Result; `hit` has no value if it fails.
  Result raycast(const Vec3& origin, const Vec3& direction, double max_distance,
                 const Filter& of_ray, ObjectFilter filter,
                 std::optional<RayHit>& hit) const noexcept;

  bool is_alive(ObjectId id) const noexcept;
  // The current values. The id must be alive.
  Box box(ObjectId id) const noexcept;
  Filter filter(ObjectId id) const noexcept;
  std::uint64_t object_count() const noexcept;
  std::uint64_t pair_count() const noexcept;
  // All ids are below this.
  std::uint64_t id_limit() const noexcept;
  // All slots of pairs that exist or ended in the last update are below this.
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
