// throng::BroadPhase on a GPU: objects, pairs, arguments and results lie in device memory. Standard
// C++ only, as throng/cuda.hpp.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/cuda.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng::cuda {

// Takes the place of an id where there is no object.
inline constexpr ObjectId no_object = 0xffffffffu;

// The results equal those of throng::BroadPhase for the same calls, byte for byte: pairs, their
// order, ids and slots. Each object has a fat box: its box at some update, expanded by `fat_margin`
// (world units, finite, >= 0). Candidates are the pairs of fat boxes. While no box leaves its fat
// box or shrinks by more than the margin, an update only compares the candidates again; from the
// third such update on, only those that the margin leaves undecided. Otherwise it finds the
// candidates of the objects that left, or all, again.
// So the margin is a trade-off: n objects of width e that move a distance v per frame have (1 + 2
// fat_margin / e)^3 times as many candidates as pairs, which stay valid for fat_margin / v updates.
// It does not change the results. 0: an update in which anything moved finds all candidates again.
//
// Ids, boxes and filters are in device memory. Each call synchronizes with its stream at least once
// to check its arguments; later launches of the call may still run when it returns. So use the same
// stream, or synchronize with it, before reading results, changing arguments or making the next
// call. A call that is refused or runs out of memory changes nothing (exception: update(boxes)).
// One thread at a time; one GPU, the current one at the first call. Memory is released on the
// stream of the last call. Result::found is the number of objects, after update() the number of
// pairs.
//
// Uses the options nan, margin, algorithm and cell_scale. At most 1.8e9 ids, and 2^32 - 2 begin and
// end events per update.
class THRONG_API BroadPhase {
 public:
  explicit BroadPhase(float fat_margin = 0, const Options& options = {},
                      const MemoryResource& memory = {}) noexcept
      : fat_margin_(fat_margin), options_(options), memory_(memory) {}
  ~BroadPhase();
  BroadPhase(BroadPhase&& other) noexcept;
  BroadPhase& operator=(BroadPhase&& other) noexcept;
  BroadPhase(const BroadPhase&) = delete;
  BroadPhase& operator=(const BroadPhase&) = delete;
  // Makes this a snapshot of `other`, which must be on the same GPU: ids, slots, margins and
  // unreported changes. No other call on either may run meanwhile.
  Result copy_from(const BroadPhase& other, Stream stream) noexcept;

  // Adds an object per box, with the view's filters. ids[i] receives the id of box i; `ids` may be
  // null. Without removals ids are 0, 1, 2, ... The id of a removed object is reused only after an
  // update has reported the pairs that its removal ended.
  Result add(const Boxes& boxes, ObjectId* ids, Stream stream) noexcept;
  // An id that is not alive, or is repeated in the list, is an error: Status::bad_id.
  Result remove(const ObjectId* ids, std::size_t count, Stream stream) noexcept;
  // Sets new boxes; of several calls before an update the last one counts.
  Result move(const ObjectId* ids, const Boxes& boxes, Stream stream) noexcept;
  // The same for all: boxes[id] for every id below id_limit(). Detects which boxes differ. Boxes of
  // ids that are not alive are ignored.
  Result move_all(const Boxes& boxes, Stream stream) noexcept;
  // One value per object of the list; absent filters stay unchanged.
  Result set_filters(const ObjectId* ids, std::size_t count, const Filters& filters,
                     Stream stream) noexcept;
  // Adds `by` to all corners, rounded to nearest.
  Result shift_origin(const Vec3& by, Stream stream) noexcept;

  // Finds the pairs that began and ended since the last update. Cost: n + candidates.
  Result update(Stream stream) noexcept;
  // move_all(boxes) and update() in one, with one synchronization less. If memory runs out, the
  // boxes may have been stored, but no event is reported: repeat the call.
  Result update(const Boxes& boxes, Stream stream) noexcept;

  // In device memory. The events of the last update; valid until the next one.
  LivePairs begun() const noexcept;
  LivePairs ended() const noexcept;
  // All pairs, sorted; valid until the next update. Compacted on the first call after an update,
  // asynchronously on the stream.
  Result pairs(LivePairs& out, Stream stream) noexcept;
  // All pairs of fat boxes that the filters allow, sorted; a slot of 0xffffffff marks boxes that do
  // not overlap themselves. A kernel that skips these needs no pairs().
  LivePairs candidates() const noexcept;

  // Queries of the objects' present boxes, with or without an update since they were set; margins
  // are ignored. The results equal those of throng::BroadPhase, byte for byte. They are in device
  // memory, valid until the next query, and empty if that fails. The first query after a change
  // bins all objects into a grid: most of the time of finding all pairs, and 49 to 57 bytes per
  // object, which stay allocated; two to four bytes more once sweeps are long.
  //
  // All objects that each box overlaps: first is the index of the box, second the object; sorted.
  Result find_overlaps(const Boxes& boxes, Stream stream) noexcept;
  Pairs overlaps() const noexcept;
  // The objects that each sweep hits; the filters hold one value per sweep, in device memory. A
  // sweep with a NaN or an infinite `by` is refused: nan_box.
  Result find_hits(const Sweep* sweeps, std::size_t count, SweepHits which, const Filters& filters,
                   Stream stream) noexcept;
  SweepHitList hits() const noexcept;
  // Writes the first hit of sweep i to out[i], in the caller's device memory; without a hit {i,
  // no_object, infinity}. Result::found is the number of sweeps with a hit. If a sweep is refused,
  // the contents of `out` are unspecified.
  Result find_first_hits(const Sweep* sweeps, std::size_t count, const Filters& filters,
                         SweepHit* out, Stream stream) noexcept;

  std::uint64_t object_count() const noexcept;
  std::uint64_t pair_count() const noexcept;
  // All ids are below this.
  std::uint64_t id_limit() const noexcept;
  // All slots of present pairs, and of those that ended in the last update, are below this.
  std::uint64_t slot_limit() const noexcept;
  // Bytes of device memory that the object holds now.
  std::size_t memory_bytes() const noexcept;
  float fat_margin() const noexcept { return fat_margin_; }

 private:
  struct State;
  friend struct BroadPhaseAccess;
  State* state_ = nullptr;
  float fat_margin_;
  Options options_;
  MemoryResource memory_;
};

}  // namespace throng::cuda
