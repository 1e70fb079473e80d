// The same across MPI ranks. Needs MPI 3 and the library throng::mpi (throng_mpi).
//
// Each rank owns some objects, named by 64-bit ids. Space is cut into one region a rank; a box is
// made known to the ranks whose regions it reaches, and a pair is told by exactly one rank: the one
// in whose region its home corner lies, on each axis the larger of the two lower corners.
//
// Collective calls are made by all ranks of the communicator, in the same order. What goes wrong on
// one rank ends the call on all of them with the same status and message, which names the rank.
// A rank that does not come, or dies where MPI survives it, ends the call of the others with
// Status::rank_failed after Settings::seconds; the object is of no use after that.
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

// How a DeviceFinder (throng/mpi_cuda.hpp) hands MPI what lies in its device's memory.
enum class Buffers : std::uint8_t {
  automatic,  // direct where MPI says that it takes device memory, else staged
  direct,     // as it lies; an MPI that does not take it ends the process. Some take it unsaid
  staged,     // copied to host memory first, and what comes from there
};

struct Settings {
  // Of the search on each rank. margin, nan and order must be the same on all ranks; the rest is
  // each rank's own: its backend (the CPU or its GPU), threads, executor and memory.
  Options search;
  // Space is cut anew before a search where, in the last one, the largest rank's work was so many
  // times the mean. Work is counted, not timed, so that runs repeat. The same on all ranks.
  double imbalance = 1.1;
  // How long a call waits for other ranks; 0: for ever.
  double seconds = 600;
  // A box that reaches more regions than this is handed on along the tree of regions, from rank to
  // rank, rather than sent by its owner to each: no rank sends many messages for it. The same on
  // all ranks.
  unsigned wide = 32;
  // BroadPhase: an object goes to the rank in whose region its lower corner lies.
  bool migrate = true;
  // DeviceFinder: each rank's own.
  Buffers buffers = Buffers::automatic;
  // Finder, on the CPU: boxes of a region that lie far apart are searched in parts. Evens out what
  // one grid makes of the gaps between clusters, and costs more than it spares: docs/scale.md.
  bool parts = false;
};

// What this rank sent, counted: to single ranks, and in collective calls (bytes of the result).
struct Counts {
  std::uint64_t messages = 0, bytes = 0, collectives = 0, collective_bytes = 0;
};

// Of the last call.
struct Traffic {
  std::uint64_t home = 0;   // boxes whose lower corner lies in this rank's region
  std::uint64_t known = 0;  // boxes that this rank searched: those, and copies of others' boxes
  std::uint64_t parts = 0;  // Finder: searches that this took, of parts that lie far apart
  std::uint64_t wide = 0;   // boxes of this rank that were handed on along the tree
  Counts halo;              // boxes sent to other ranks
  Counts balance;           // cutting space anew
  Counts control;           // agreement, and the check of ids
  bool cut_anew = false;    // before the search
  bool direct = false;      // DeviceFinder: MPI was given device memory as it lies
  std::uint64_t work = 0;   // of this rank, counted
  double imbalance = 1;     // the largest rank's work over the mean
};

// A view of pairs; good until the next call. first < second in the one-set form.
struct Pairs64 {
  const Pair64* data_ = nullptr;
  std::size_t size_ = 0;

  const Pair64* data() const noexcept { return data_; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  const Pair64* begin() const noexcept { return data_; }
  const Pair64* end() const noexcept { return data_ + size_; }
  const Pair64& operator[](std::size_t i) const noexcept { return data_[i]; }
};

// The boxes of this rank, and their ids; null: they are numbered through by rank, from 0 on rank 0.
// An id may be given once, over all ranks. Filters hang on the view.
struct RankBoxes {
  Boxes boxes;
  const std::uint64_t* ids = nullptr;
};

// Finds all overlapping pairs, frame after frame. Result::found, inactive, comparisons and visited
// are sums over all ranks, `written` is how many pairs this rank tells. The communicator is
// duplicated at the first call; the object must end before MPI_Finalize.
class Finder {
 public:
  explicit Finder(MPI_Comm comm, const Settings& settings = {}) noexcept;
  ~Finder();
  Finder(Finder&& other) noexcept;
  Finder& operator=(Finder&& other) noexcept;
  Finder(const Finder&) = delete;
  Finder& operator=(const Finder&) = delete;

  // Collective. A rank may have no boxes. Of two sets `first` is an id of a, `second` one of b;
  // each set has ids of its own.
  // Cost: as throng::Finder's of the boxes that reach a rank's region; docs/scale.md.
  Result find(const RankBoxes& boxes) noexcept;
  Result find(const RankBoxes& a, const RankBoxes& b) noexcept;
  // Those that this rank tells; with Order::canonical sorted.
  Pairs64 pairs() const noexcept;

  const Traffic& traffic() const noexcept;
  // The rank in whose region a box's lower corner lies: who keeps it there sends the least. Before
  // the first search 0.
  int home(const Box& box) const noexcept;

 private:
  struct State;
  Settings settings_;
  MPI_Comm comm_;
  std::unique_ptr<State> state_;
};

// An object that went to another rank.
struct Departure {
  std::uint64_t id;
  int rank;
};

// Objects that live across ranks: each is held by one rank, which adds, moves and removes it; a
// collective update() then tells which pairs began and ended, each on one rank: a pair that began
// where its home corner is now, one that ended where it was before. That a pair's home goes from
// rank to rank is no event. The cost follows the objects that changed.
//
// The calls on objects are this rank's own: they are checked here and fail here, and change nothing
// if they do. That an id is given twice over all ranks is told by update(), to all, which then
// changes nothing: remove() takes the addition back. An id may be given away again only after an
// update has told its removal. An update that fails by memory or by MPI leaves the object of no
// use.
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
  // Filters that hang on the view are not looked at.
  Result move(const std::uint64_t* ids, const Boxes& boxes) noexcept;
  // Filters that are absent stay as they were.
  Result set_filters(const std::uint64_t* ids, std::size_t count, const Filters& filters) noexcept;

  // Collective. found: the pairs that live now, over all ranks; written: how many events this rank
  // tells.
  // Cost: as throng::BroadPhase's of the objects that reach a rank's region.
  Result update() noexcept;
  // What the last update told on this rank, sorted.
  Pairs64 begun() const noexcept;
  Pairs64 ended() const noexcept;
  // All pairs whose home is here since the last update, sorted. Not collective. Throws
  // std::bad_alloc.
  Pairs64 pairs();

  // Objects that came to this rank with the last update, and those that left it: from now on the
  // other rank moves them. What else belongs to an object is the caller's to send.
  const std::uint64_t* arrived() const noexcept;
  std::size_t arrived_count() const noexcept;
  const Departure* departed() const noexcept;
  std::size_t departed_count() const noexcept;

  bool holds(std::uint64_t id) const noexcept;
  // As given last; the object must be held here.
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
