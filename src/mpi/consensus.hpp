// Consensus on the status of a collective call: a failure on one rank becomes the failure of all,
// with the same message.
#pragma once

#include <cstdint>
#include <exception>
#include <new>

#include <throng/mpi.hpp>

#include "device/failure.hpp"
#include "mpi/communicator.hpp"

namespace throng::mpi {

void set_error(Result& r, Status status, const char* format, ...) noexcept
    __attribute__((format(printf, 3, 4)));

// The message for a device failure.
void set_error(Result& r, const device::Failure& failure) noexcept;

// Settings that must be equal on all ranks.
struct ConsensusSettings {
  std::uint64_t margin, imbalance, nan, order, tree_send_threshold, form;
};
ConsensusSettings consensus_settings(const Settings& settings, std::uint64_t form) noexcept;

// Runs a local part of a collective call. Exceptions are stored in r, for the next consensus.
template <class F>
void attempt(Result& r, F&& f) noexcept {
  if (!r.ok()) return;
  try {
    f();
  } catch (const device::Failure& failure) {
    set_error(r, failure);
  } catch (const std::bad_alloc&) {
    set_error(r, Status::out_of_memory, "out of memory for this rank's boxes; use more ranks");
  }
}

// Collective. If r is an error on some rank, all ranks get the r of the first such rank. `bits` are
// combined by OR over all ranks.
bool consensus(Communicator& communicator, Result& r, std::uint64_t* bits, int count);
// The same, and checks that the settings are equal.
bool consensus(Communicator& communicator, Result& r, const ConsensusSettings& settings,
               std::uint64_t* bits, int count);

// Local check of the settings.
bool valid(const Settings& settings, Result& r) noexcept;

// The checks of throng::Finder, before boxes are sent, so that the reported index is that of this
// rank.
bool valid(const Boxes& boxes, const Options& options, Result& r) noexcept;
bool valid_filters(const Filters& filters, std::size_t count, Result& r) noexcept;
// The same in parts: first the arrays alone, which may lie in device memory; then the contents, as
// r.invalid_count boxes with a world below -1 or with a NaN, the first of them r.first_invalid.
bool valid_arrays(const Boxes& boxes, Result& r) noexcept;
bool no_bad_worlds(Result& r) noexcept;
bool no_nans(Result& r) noexcept;

// Sets the default floating-point environment for its scope: round to nearest, denormals kept.
class DefaultFloats {
 public:
  DefaultFloats() noexcept;
  ~DefaultFloats();
  DefaultFloats(const DefaultFloats&) = delete;
  DefaultFloats& operator=(const DefaultFloats&) = delete;

 private:
  alignas(16) unsigned char saved_[64];
};

// Runs a collective call: creates the communicator if needed, and converts exceptions to a status.
template <class F>
Result call(std::unique_ptr<Communicator>& communicator, MPI_Comm comm, const Settings& settings,
            F&& f) noexcept {
  const DefaultFloats floats;
  Result r;
  try {
    if (!mpi_is_initialized()) {
      set_error(r, Status::rank_failed,
                "MPI is not initialized; call between MPI_Init and MPI_Finalize");
      return r;
    }
    if (!communicator)
      communicator = std::make_unique<Communicator>(comm, settings.timeout_seconds);
    f(*communicator, r);
  } catch (const std::bad_alloc&) {
    set_error(r, Status::out_of_memory, "out of memory during a collective call; use more ranks");
  } catch (const std::exception& failure) {
    set_error(r, Status::rank_failed, "%s; create a new object, or restart the job",
              failure.what());
  }
  return r;
}

}  // namespace throng::mpi
