// One answer from all ranks: what fails on one fails on all, in the same words.
#pragma once

#include <cstdint>
#include <exception>
#include <new>

#include <throng/mpi.hpp>

#include "mpi/link.hpp"
#include "pipeline/failure.hpp"

namespace throng::mpi {

void say(Result& r, Status status, const char* format, ...) noexcept
    __attribute__((format(printf, 3, 4)));

// What a device says of itself, in words.
void say(Result& r, const pipeline::Failure& failure) noexcept;

// What must be the same on all ranks.
struct Agreed {
  std::uint64_t margin, imbalance, nan, order, wide, form;
};
Agreed agreed(const Settings& settings, std::uint64_t form) noexcept;

// Runs this rank's own part of a call: what goes wrong is kept for the next agreement.
template <class F>
void attempt(Result& r, F&& f) noexcept {
  if (!r.ok()) return;
  try {
    f();
  } catch (const pipeline::Failure& failure) {
    say(r, failure);
  } catch (const std::bad_alloc&) {
    say(r, Status::out_of_memory, "no memory for what this rank must know; use more ranks");
  }
}

// Collective: where r is bad on some rank, r of the first such rank becomes that of all. `bits` are
// or-ed over all ranks.
bool agree(Link& link, Result& r, std::uint64_t* bits, int count);
// The same, and the settings are compared.
bool agree(Link& link, Result& r, const Agreed& settings, std::uint64_t* bits, int count);

// Settings and the state of MPI, as far as this rank alone can tell.
bool valid(const Settings& settings, Result& r) noexcept;

// What the door of a search would say of these boxes, before they are sent: the first bad one by
// its place here.
bool valid(const Boxes& boxes, const Options& options, Result& r) noexcept;
bool valid_filters(const Filters& filters, std::size_t count, Result& r) noexcept;
// The same in parts. Arrays alone, which may lie in a device's memory; then what stands there:
// r.invalid_count boxes with a world below -1, or with a NaN, the first of them r.first_invalid.
bool valid_arrays(const Boxes& boxes, Result& r) noexcept;
bool no_bad_worlds(Result& r) noexcept;
bool no_nans(Result& r) noexcept;

// The default floating-point environment while it lives: rounding to nearest, denormals kept.
class DefaultFloats {
 public:
  DefaultFloats() noexcept;
  ~DefaultFloats();
  DefaultFloats(const DefaultFloats&) = delete;
  DefaultFloats& operator=(const DefaultFloats&) = delete;

 private:
  alignas(16) unsigned char saved_[64];
};

// Runs a collective call: makes the link, and turns what is thrown into a status.
template <class F>
Result call(std::unique_ptr<Link>& link, MPI_Comm comm, const Settings& settings, F&& f) noexcept {
  const DefaultFloats floats;
  Result r;
  try {
    if (!mpi_is_up()) {
      say(r, Status::rank_failed, "MPI is not up; call between MPI_Init and MPI_Finalize");
      return r;
    }
    if (!link) link = std::make_unique<Link>(comm, settings.seconds);
    f(*link, r);
  } catch (const std::bad_alloc&) {
    say(r, Status::out_of_memory, "no memory amid a call of all ranks; use more ranks");
  } catch (const std::exception& failure) {
    say(r, Status::rank_failed, "%s; make a new object, or a new job", failure.what());
  }
  return r;
}

}  // namespace throng::mpi
