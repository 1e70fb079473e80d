// What ranks say to one another: MPI with a deadline on every wait, counted.
#pragma once

#include <mpi.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include <throng/mpi.hpp>

namespace throng::mpi {

// MPI failed, or a rank did not come in time: nothing more can be said.
struct Broken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Bytes = std::vector<std::byte>;

struct Parcel {
  int rank;  // whom it is for, or from
  Bytes data;
};

// A run of bytes that MPI reads or writes where it lies: memory of a device, too, where it takes
// such.
struct Slice {
  int rank;  // whom it is for, or from: not this one
  std::byte* data;
  std::size_t bytes;
};

// Every call is collective unless said otherwise, waits at most the seconds given, and throws
// Broken. After that the Link is broken for good, and what MPI may still touch is left where it
// lies.
class Link {
 public:
  // `comm` is duplicated. seconds <= 0: for ever.
  Link(MPI_Comm comm, double seconds);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  int rank() const noexcept { return rank_; }
  int size() const noexcept { return size_; }

  // Element by element over all ranks, in place.
  void sum(std::uint64_t* values, int count) { reduce(values, count, MPI_UINT64_T, MPI_SUM, 0); }
  void most(std::uint64_t* values, int count) { reduce(values, count, MPI_UINT64_T, MPI_MAX, 0); }
  void any_bits(std::uint64_t* values, int count) {
    reduce(values, count, MPI_UINT64_T, MPI_BOR, 0);
  }
  // Both at once.
  void sum_and_most(std::uint64_t* sums, int count, std::uint64_t& most);
  // The sum over the ranks before this one.
  std::uint64_t before(std::uint64_t mine);
  // The bytes of `root` for all.
  void from(int root, void* data, int bytes);
  // `bytes` of each rank, in order of the ranks; out has room for all.
  void gather(const void* mine, int bytes, void* out);

  // Parcels to any ranks, this one among them or not; gives what came, one a rank, by rank. Costs
  // each rank its own parcels and a barrier, whatever the number of ranks: who sends to whom need
  // not be known. (Hoefler, Siebert and Lumsdaine, "Scalable communication protocols for dynamic
  // sparse data exchange", PPoPP 2010: synchronous sends, then a barrier that does not block.)
  std::vector<Parcel> exchange(std::vector<Parcel> parcels);
  // Not collective: gives `to` and takes `from`, whose sizes both sides know. Those between two
  // ranks go in the order of the lists.
  void exchange(const std::vector<Slice>& to, const std::vector<Slice>& from);

  // The nodes of the tree of regions that this rank lies in, from the root: levels() of them.
  struct Node {
    int begin, end;
    MPI_Comm comm;
  };
  int levels() const noexcept { return static_cast<int>(nodes_.size()); }
  // Node `level`; the last has this rank alone. Makes the communicators at the first call.
  const Node& node(int level);
  void make_nodes();
  // Among the ranks of node `level`.
  void sum(int level, std::uint64_t* values, int count) {
    reduce(values, count, MPI_UINT64_T, MPI_SUM, level);
  }
  void most(int level, std::int64_t* values, int count) {
    reduce(values, count, MPI_INT64_T, MPI_MAX, level);
  }
  // Gives data to a partner in the other half of node `level`, and adds what partners gave to
  // `got`.
  void swap(int level, const Bytes& data, Bytes& got);

  // Something failed: memory of slices that were under way may still be written.
  bool broken() const noexcept { return broken_; }

  // Since the last reset.
  const Counts& counts() const noexcept { return counts_; }
  void reset_counts() noexcept { counts_ = {}; }

 private:
  struct Pending;
  using Clock = std::chrono::steady_clock;

  void reduce(void* values, int count, MPI_Datatype type, MPI_Op op, int level);
  void send(int rank, int tag, const std::byte* data, std::size_t bytes, bool synchronous);
  void wait_for_all();
  bool receive(int rank, int tag, Parcel& parcel);
  template <class Done>
  void wait(Done&& done);
  void wait_for(MPI_Request& request);
  void check(int code, const char* what);

  MPI_Comm comm_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
  double seconds_;
  int tag_ = 0;
  bool broken_ = false;
  std::vector<Node> nodes_;
  Counts counts_;
  std::unique_ptr<Pending> pending_;
};

// True where MPI can be used: after MPI_Init, before MPI_Finalize.
bool mpi_is_up() noexcept;

}  // namespace throng::mpi
