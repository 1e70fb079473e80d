// Argument checks, and messages for what went wrong.
#pragma once

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/options.hpp>
#include <throng/update_boxes.hpp>

#include "base/update_boxes.hpp"
#include "device/failure.hpp"

namespace throng::grid {
struct Kernels;
}

namespace throng {

// Formats Result::message.
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void set_message(Result& r, const char* format, ...) noexcept;

inline bool refuse(Result& r, Status status) noexcept {
  r.status = status;
  return false;
}
bool valid_margin(float margin, Result& r) noexcept;
// Checks that each enumeration holds one of its constants.
bool valid_choices(const Options& options, Result& r) noexcept;
// Checks that the backend is not a device; `what` names the operation: "a search is explained".
bool valid_on_cpu(const Options& options, const char* what, Result& r) noexcept;
// Checks that a given executor has a function that runs tasks.
bool valid_executor(const Executor* executor, Result& r) noexcept;
// The kernels of an instruction set; null, with status and message, if unavailable. `option` names
// the option that requested it.
const grid::Kernels* kernels_for(Isa isa, const char* option, Result& r) noexcept;

// Full check of a call; false, with status and message, if invalid. b null: one set.
bool valid(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept;
bool valid(const DoubleBoxes& a, const DoubleBoxes* b, const Options& options, Result& r) noexcept;
// The same for one set, with options already checked.
bool valid(const Boxes& set, Result& r) noexcept;

// The same for boxes in device memory: values that need a read of the boxes are left to the device.
bool valid_on_device(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept;

// Prepares the per-body job without reading the arrays' contents. False, with status and message,
// if the arguments are invalid.
bool make_job(const Bodies& bodies, Box* out, const UpdateOptions& options,
              std::size_t stride_bytes, base::UpdateBoxes& job, Result& r) noexcept;

// Sets status and message for a failed device. if_no_memory: the fix that fits the call.
void explain_failure(Result& r, const device::Failure&,
                     const char* if_no_memory = "free some, or give fewer boxes at once") noexcept;

// Allocates an object's state from the caller's memory resource. Null, with status and message, on
// failure.
void* allocate_state(std::pmr::memory_resource& memory, std::size_t bytes, std::size_t alignment,
                     Result& r) noexcept;

// Checks that the array is not null unless empty, and that `which` is valid. False, with status and
// message, if not.
bool valid_sweeps(const Sweep* sweeps, std::size_t count, SweepHits which, Result& r) noexcept;
// Sets the message for sweeps that have a NaN or an infinite `by`.
void explain_sweeps(Result& r) noexcept;

// Sets the message for a failure that a backend reported. if_no_memory: the fix that fits the call.
void explain(Result& r, bool two_sets, bool nan_in_second_set, const char* if_no_memory) noexcept;

}  // namespace throng
