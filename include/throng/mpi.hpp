// Finder and BroadPhase across MPI ranks. Needs MPI 3 and the library throng::mpi (throng_mpi).
//
// Each rank owns some objects, named by 64-bit ids. Space is partitioned into one region per rank.
// A box is sent to every rank whose region it overlaps. Each pair is reported by exactly one rank,
// its owner: the rank whose region contains the pair's reference corner, which on each axis is the
// larger of the two lower corners.
//
// Collective calls must be made by all ranks of the communicator, in the same order. A failure on
// one rank ends the call on all ranks with the same status and message; the message names the rank.
// If a rank does not make the call within Settings::timeout_seconds, or dies and MPI survives it,
// the others return Status::rank_failed and the object is unusable afterwards.
#pragma once

#include <throng/cpp17.hpp>

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include <throng/boxes.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng::mpi {

// How a DeviceFinder (throng/mpi_cuda.hpp) passes device memory to MPI.
enum class Buffers : std::uint8_t {
  automatic,  // direct if MPI reports support for device memory, else staged
  direct,     // device pointers; ends the process if MPI lacks support (not all MPIs report it)
  staged,     // through buffers in host memory
};

struct Settings {
  // Options of the search on each rank. margin, nan and order must be the same on all ranks;
  // backend, threads, executor and memory may differ.
  Options search;
  // Repartition before a search if, in the last one, the largest rank's work exceeded the mean by
  // this factor; >= 1. Work is counted, not timed, so that runs are reproducible. The same on all
  // ranks.
  double imbalance = 1.1;
  // How long a call waits for other ranks; 0: no limit.
  double timeout_seconds = 600;
  // A box that overlaps more regions than this is forwarded along the tree of regions, from rank to
  // rank, instead of being sent by its owner to each. This bounds the messages per rank. >= 1. The
  // same on all ranks.
  unsigned tree_send_threshold = 32;
  // BroadPhase: move each object to the rank whose region contains its lower corner.
  bool migrate = true;
  // DeviceFinder; may differ between ranks.
  Buffers buffers = Buffers::automatic;
  // Finder on the CPU: search groups of boxes of a region that lie far apart separately. Reduces
  // the imbalance that gaps between clusters cause, but costs more than it saves:
  // docs/how-to/mpi.md.
  bool parts = false;
};

// What this rank sent: point-to-point messages, and collective operations (bytes of the result).
struct Counts {
  std::uint64_t messages = 0, bytes = 0, collectives = 0, collective_bytes = 0;
};

// Statistics of the last call on this rank.
struct Traffic {
  std::uint64_t home = 0;             // boxes whose lower corner lies in this rank's region
  std::uint64_t owned_and_ghost = 0;  // boxes searched here: own boxes and ghosts (copies)
  std::uint64_t parts = 0;            // Finder: separate searches of groups that lie far apart
  std::uint64_t wide = 0;             // boxes of this rank that were forwarded along the tree
  Counts halo;                        // boxes sent to other ranks
  Counts balance;                     // repartitioning
  Counts control;                     // consensus on the status, and the check of ids
  bool cut_anew = false;              // space was repartitioned before the search
  bool direct = false;                // DeviceFinder: MPI was given device pointers
  std::uint64_t work = 0;             // counted work of this rank
  double imbalance = 1;               // the largest rank's work over the mean
};

// A view of pairs, valid until the next call. One set: first < second.
using Pairs64 = ArrayView<Pair64>;

// The boxes and filters of this rank, and one id per box. Each id may occur once over all ranks.
// Null ids: boxes are numbered consecutively by rank, starting at 0 on rank 0.
struct RankBoxes {
  Boxes boxes;
  const std::uint64_t* ids = nullptr;
};

// Finds all overlapping pairs across ranks. Result::found, inactive, comparisons and visited are
// sums over all ranks; `written` is the number of pairs that this rank reports. The communicator is
// duplicated at the first call. Destroy the object before MPI_Finalize.
class Finder {
 public:
  explicit Finder(MPI_Comm comm, const Settings& settings = {}) noexcept;
  ~Finder();
  Finder(Finder&& other) noexcept;
  Finder& operator=(Finder&& other) noexcept;
  Finder(const Finder&) = delete;
  Finder& operator=(const Finder&) = delete;

  // Collective. A rank may have no boxes. Two sets: `first` is an id of a, `second` one of b; each
  // set has its own ids.
  // Cost: that of throng::Finder for the boxes that overlap a rank's region; see
  // docs/how-to/mpi.md.
  Result find(const RankBoxes& boxes) noexcept;
  Result find(const RankBoxes& a, const RankBoxes& b) noexcept;
  // The pairs that this rank reports; sorted with Order::canonical.
  Pairs64 pairs() const noexcept;

  const Traffic& traffic() const noexcept;
  // The rank whose region contains the box's lower corner; 0 before the first search. Communication
  // is least if each box is held by that rank.
  int home(const Box& box) const noexcept;

 private:
  struct State;
  Settings settings_;
  MPI_Comm comm_;
  std::unique_ptr<State> state_;
};

// An object that migrated to another rank.
struct Departure {
  std::uint64_t id;
  int rank;
};

// Persistent objects across ranks. Each object is held by one rank, which adds, moves and removes
// it. The collective update() finds the pairs that began and ended. Each event is reported on one
// rank: a begin event on the pair's owner, an end event on its previous owner. A change of a pair's
// owner is not an event. The cost follows the number of changed objects.
//
// add, remove, move and set_filters are local: arguments are checked on this rank, and a failed
// call changes nothing. A duplicate id across ranks is reported by update() on all ranks; it then
// changes nothing, and remove() reverts the addition. An id may be reused only after an update has
// processed its removal. An update that fails for lack of memory or in MPI leaves the object
// unusable.
class BroadPhase {
 public:
  explicit BroadPhase(MPI_Comm comm, const Settings& settings = {}) noexcept;
  ~BroadPhase();
  BroadPhase(BroadPhase&& other) noexcept;
  BroadPhase& operator=(BroadPhase&& other) noexcept;
  BroadPhase(const BroadPhase&) = delete;
  BroadPhase& operator=(const BroadPhase&) = delete;

  Result add(const std::uint64_t* ids, const Boxes& boxes) noexcept;
  Result remove(const std::uint64_t* ids, std::size_t count) noexcept;
  // Ignores the view's filters.
  Result move(const std::uint64_t* ids, const Boxes& boxes) noexcept;
  // Absent filters stay unchanged.
  Result set_filters(const std::uint64_t* ids, std::size_t count, const Filters& filters) noexcept;

  // Collective. Result::found: the current number of pairs over all ranks; written: the number of
  // events on this rank.
  // Cost: that of throng::BroadPhase for the objects that overlap a rank's region.
  Result update() noexcept;
  // Begin and end events of the last update on this rank, sorted.
  Pairs64 begun() const noexcept;
  Pairs64 ended() const noexcept;
  // All pairs that this rank owns since the last update, sorted. Not collective. Throws
  // std::bad_alloc.
  Pairs64 pairs();

  // Ids of objects that migrated to this rank in the last update, and objects that left it. The new
  // rank moves them from now on. Migrating other data of an object is up to the caller.
  const std::uint64_t* arrived() const noexcept;
  std::size_t arrived_count() const noexcept;
  const Departure* departed() const noexcept;
  std::size_t departed_count() const noexcept;

  bool holds(std::uint64_t id) const noexcept;
  // The box given last. The object must be held by this rank.
  Box box(std::uint64_t id) const noexcept;
  std::size_t object_count() const noexcept;
  const Traffic& traffic() const noexcept;

 private:
  struct State;
  template <class F>
  Result local(F&& f) noexcept;

  Settings settings_;
  MPI_Comm comm_;
  std::unique_ptr<State> state_;
};

}  // namespace throng::mpi
