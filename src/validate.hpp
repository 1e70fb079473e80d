// What is asked is checked, and what went wrong is put into words.
#pragma once

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/options.hpp>
#include <throng/update_boxes.hpp>

#include "core/update_boxes.hpp"
#include "pipeline/failure.hpp"

namespace throng::cpu {
struct Kernels;
}

namespace throng {

// Into Result::message.
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void say(Result& r, const char* format, ...) noexcept;

inline bool refuse(Result& r, Status status) noexcept {
  r.status = status;
  return false;
}
bool valid_margin(float margin, Result& r) noexcept;
// Whether each enumeration is one of its constants.
bool valid_choices(const Options& options, Result& r) noexcept;
// Whether the backend is not one that cannot; `what`: "a search is explained".
bool valid_on_cpu(const Options& options, const char* what, Result& r) noexcept;
// Whether an executor, if there is one, has a function that runs tasks.
bool valid_executor(const Executor* executor, Result& r) noexcept;
// Null, with status and message, where it is not to be had; `option` is what asked for it.
const cpu::Kernels* kernels_for(Isa isa, const char* option, Result& r) noexcept;

// False, with status and message, where a backend could not take this. b null: one set.
bool valid(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept;
bool valid(const DoubleBoxes& a, const DoubleBoxes* b, const Options& options, Result& r) noexcept;
// The same of one set, by options that are valid.
bool valid(const Boxes& set, Result& r) noexcept;

// The same for boxes in device memory: what needs a look at them is left to the device.
bool valid_on_device(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept;

// The job that each thread does a body of, without a look at the arrays' contents. False, with
// status and message, where a backend could not take this.
bool make_job(const Bodies& bodies, Box* out, const UpdateOptions& options,
              std::size_t stride_bytes, core::UpdateBoxes& job, Result& r) noexcept;

// Status and message for a device that failed. if_no_memory: the remedy that the call has.
void explain_failure(Result& r, const pipeline::Failure&,
                     const char* if_no_memory = "free some, or give fewer boxes at once") noexcept;

// Room for what stands behind a door, of the caller's memory. Null, with status and message, where
// that gives none.
void* take_room(std::pmr::memory_resource& memory, std::size_t bytes, std::size_t alignment,
                Result& r) noexcept;

// Whether there is an array, if there are any, and it is known what is wanted of them. False, with
// status and message.
bool valid_sweeps(const Sweep* sweeps, std::size_t count, SweepHits which, Result& r) noexcept;
// The message for sweeps of which some have a NaN or an infinite `by`.
void explain_sweeps(Result& r) noexcept;

// The message for what a backend found wrong. if_no_memory: the remedy that the call has.
void explain(Result& r, bool two_sets, bool nan_in_second_set, const char* if_no_memory) noexcept;

}  // namespace throng
