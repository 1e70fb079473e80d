// throng::BroadPhase on a GPU: objects, pairs, and all that is given and told lie in device memory.
// Standard C++ only, as throng/cuda.hpp.
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

// In place of an object's id: there is none.
inline constexpr ObjectId no_object = 0xffffffffu;

// What it tells is what throng::BroadPhase tells of the same calls, byte for byte: pairs, their
// order, ids and slots. Each object lies in a fat box, wider by `fat_margin` (world units, finite,
// >= 0) than its box when that was made. While no box leaves its fat box, nor shrinks by more than
// the margin, an update compares the candidates again, which are the pairs of fat boxes, or, from
// the third such update on, those of which the margin leaves it open whether they are pairs. When
// one does, its candidates are found anew, or all.
// So the margin is a trade: n objects of width e that go a distance v a frame have candidates for
// (1 + 2 fat_margin / e)^3 times as many pairs, and are good for fat_margin / v updates. It does
// not change what is told. 0: whatever moves has all candidates found anew.
//
// Ids, boxes and filters are given in device memory, on a stream, and each call waits for it once
// or a few times, to learn how it went. What it then puts may still run: whoever goes on, reads
// what is told, or writes what was given, does so on that stream, or waits for it. A call that is
// refused or runs out of memory changes nothing, but see update(boxes). One thread at a time; one
// GPU, that which is current at its first call. What it holds is given back on the stream of its
// last call. Result::found of a call on objects is how many there are then, of update() how many
// pairs live.
//
// Of Options these hold here: nan, margin, algorithm and cell_scale. At most 1.8e9 ids, and 2^32 -
// 2 pairs that begin or end in one update.
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
  // Makes this a snapshot of the other, which must be of the same GPU: ids, slots, margins, and
  // what has not been told yet. Nothing may use either meanwhile.
  Result copy_from(const BroadPhase& other, Stream stream) noexcept;

  // An object for each box, with the filters that hang on the view; ids[i] is that of box i, null:
  // nobody asks. 0, 1, 2, ... where none was removed. The id of a removed object is given away
  // again only after an update has told which pairs its removal ended.
  Result add(const Boxes& boxes, ObjectId* ids, Stream stream) noexcept;
  // An id that is not alive, or twice in one list, is an error: Status::bad_id.
  Result remove(const ObjectId* ids, std::size_t count, Stream stream) noexcept;
  // Gives objects new boxes; of several calls before an update the last wins.
  Result move(const ObjectId* ids, const Boxes& boxes, Stream stream) noexcept;
  // The same for all: boxes[id] for every id below id_limit(). It finds out which boxes differ.
  // Those of ids that are not alive are not looked at.
  Result move_all(const Boxes& boxes, Stream stream) noexcept;
  // One value an object of the list; filters that are absent stay as they were.
  Result set_filters(const ObjectId* ids, std::size_t count, const Filters& filters,
                     Stream stream) noexcept;
  // Adds `by` to all corners, rounded to nearest.
  Result shift_origin(const Vec3& by, Stream stream) noexcept;

  // Finds the pairs that began and ended since the last update.
  // Cost: n + candidates.
  Result update(Stream stream) noexcept;
  // move_all(boxes) and update() in one, which waits once less. Where memory runs out the boxes may
  // have been taken, but nothing has been told: give them again.
  Result update(const Boxes& boxes, Stream stream) noexcept;

  // In device memory. What the last update told; good until the next one.
  LivePairs begun() const noexcept;
  LivePairs ended() const noexcept;
  // All pairs there are, sorted; good until the next update. They are put together when they are
  // asked for, by work on the stream that is not waited for.
  Result pairs(LivePairs& out, Stream stream) noexcept;
  // All pairs of fat boxes that filters allow, sorted; a slot of 0xffffffff: the boxes themselves
  // do not overlap. A kernel that passes over these needs no pairs().
  LivePairs candidates() const noexcept;

  // Questions to the objects as they were given last, with an update since or without; the margins
  // play no part. What is found is that which throng::BroadPhase finds, byte for byte, and lies in
  // device memory, good until the next question, and gone if that fails. The first question after a
  // change puts all objects into a grid, which takes as long as finding all pairs does for the most
  // part, and 49 to 57 bytes an object that stay, and two to four more once sweeps go far.
  //
  // All objects that each box overlaps: first is the number of the box, second the object; sorted.
  Result find_overlaps(const Boxes& boxes, Stream stream) noexcept;
  Pairs overlaps() const noexcept;
  // The objects that each sweep meets; the filters hold one value a sweep, in device memory. A
  // sweep with a NaN, or a `by` that is not finite, is refused: nan_box.
  Result find_hits(const Sweep* sweeps, std::size_t count, SweepHits which, const Filters& filters,
                   Stream stream) noexcept;
  SweepHitList hits() const noexcept;
  // Into out[i], which is the caller's device memory, what sweep i meets first; where that is
  // nothing, {i, no_object, infinity}. Result::found tells how many meet something. Where a sweep
  // is refused, what stands in `out` is of no use.
  Result find_first_hits(const Sweep* sweeps, std::size_t count, const Filters& filters,
                         SweepHit* out, Stream stream) noexcept;

  std::uint64_t object_count() const noexcept;
  std::uint64_t pair_count() const noexcept;
  // All ids are below this.
  std::uint64_t id_limit() const noexcept;
  // All slots of pairs that live, or ended in the last update, are below this.
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
