// Communication between ranks: MPI with a timeout on every wait, and counters.
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

// MPI failed, or a rank timed out: no further communication is possible.
struct CommunicationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Bytes = std::vector<std::byte>;

struct Parcel {
  int rank;  // destination or source
  Bytes data;
};

// A range of bytes that MPI accesses in place; may be device memory if MPI is CUDA-aware.
struct Slice {
  int rank;  // destination or source, never this rank
  std::byte* data;
  std::size_t bytes;
};

// Every call is collective unless noted, waits at most `timeout_seconds`, and throws
// CommunicationError on failure. After that the Communicator is unusable, and buffers that MPI may
// still access are leaked.
class Communicator {
 public:
  // Duplicates `comm`. timeout_seconds <= 0: no timeout.
  Communicator(MPI_Comm comm, double timeout_seconds);
  ~Communicator();
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  int rank() const noexcept { return rank_; }
  int size() const noexcept { return size_; }

  // Element-wise reductions over all ranks, in place.
  void all_reduce_sum(std::uint64_t* values, int count) {
    reduce(values, count, MPI_UINT64_T, MPI_SUM, 0);
  }
  void all_reduce_max(std::uint64_t* values, int count) {
    reduce(values, count, MPI_UINT64_T, MPI_MAX, 0);
  }
  void all_reduce_or(std::uint64_t* values, int count) {
    reduce(values, count, MPI_UINT64_T, MPI_BOR, 0);
  }
  // Both in one round.
  void all_reduce_sum_and_max(std::uint64_t* sums, int count, std::uint64_t& most);
  // Exclusive prefix sum over the ranks.
  std::uint64_t exclusive_sum(std::uint64_t mine);
  // Broadcast from `root`.
  void broadcast(int root, void* data, int bytes);
  // Gathers `bytes` of each rank, ordered by rank; `out` has size() * bytes.
  void all_gather(const void* mine, int bytes, void* out);

  // Sends parcels to any ranks, including this one; returns those received, one per source, sorted
  // by rank. Receivers need not know their senders. Cost per rank: its own parcels and a barrier,
  // independent of the number of ranks. (Hoefler, Siebert and Lumsdaine, "Scalable communication
  // protocols for dynamic sparse data exchange", PPoPP 2010: synchronous sends, then a non-blocking
  // barrier.)
  std::vector<Parcel> exchange(std::vector<Parcel> parcels);
  // Not collective: sends `to` and receives `from`; both sides know the sizes. Slices between two
  // ranks match in the order of the lists.
  void exchange(const std::vector<Slice>& to, const std::vector<Slice>& from);

  // The tree nodes that contain this rank, from the root: levels() of them.
  struct Node {
    int begin, end;
    MPI_Comm comm;
  };
  int levels() const noexcept { return static_cast<int>(nodes_.size()); }
  // Node `level`; the last contains only this rank. Creates the communicators at the first call.
  const Node& node(int level);
  void make_nodes();
  // Reductions among the ranks of node `level`.
  void all_reduce_sum(int level, std::uint64_t* values, int count) {
    reduce(values, count, MPI_UINT64_T, MPI_SUM, level);
  }
  void all_reduce_max(int level, std::int64_t* values, int count) {
    reduce(values, count, MPI_INT64_T, MPI_MAX, level);
  }
  // Sends data to a partner in the other half of node `level`, and appends the partners' data to
  // `got`.
  void swap_halves(int level, const Bytes& data, Bytes& got);

  // After a failure, MPI may still write to buffers of pending slices.
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
  double timeout_seconds_;
  int tag_ = 0;
  bool broken_ = false;
  std::vector<Node> nodes_;
  Counts counts_;
  std::unique_ptr<Pending> pending_;
};

// True between MPI_Init and MPI_Finalize.
bool mpi_is_initialized() noexcept;

}  // namespace throng::mpi
