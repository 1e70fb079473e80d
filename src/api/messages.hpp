// Messages for what went wrong.
#pragma once

#include <cstddef>

#include <throng/memory_resource.hpp>
#include <throng/options.hpp>

#include "device/failure.hpp"

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

// Sets status and message for a failed device. if_no_memory: the fix that fits the call.
void explain_failure(Result& r, const device::Failure&,
                     const char* if_no_memory = "free some, or give fewer boxes at once") noexcept;

// Allocates an object's state from the caller's memory resource. Null, with status and message, on
// failure.
void* allocate_state(std::pmr::memory_resource& memory, std::size_t bytes, std::size_t alignment,
                     Result& r) noexcept;

// Sets the message for sweeps that have a NaN or an infinite `by`.
void explain_sweeps(Result& r) noexcept;

// Sets the message for a failure that a backend reported. if_no_memory: the fix that fits the call.
void explain(Result& r, bool two_sets, bool nan_in_second_set, const char* if_no_memory) noexcept;

}  // namespace throng
