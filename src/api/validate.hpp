// Argument checks.
#pragma once

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/options.hpp>

#include "messages.hpp"

namespace throng::grid {
struct Kernels;
}

namespace throng {

bool valid_margin(float margin, Result& r) noexcept;
bool valid_cell_scale(float scale, Result& r) noexcept;
// Checks that each enumeration holds one of its constants.
bool valid_choices(const Options& options, Result& r) noexcept;
// Checks that the backend is not a device; `what` names the operation: "a search is explained".
bool valid_on_cpu(const Options& options, const char* what, Result& r) noexcept;
// Checks that a given executor has a function that runs tasks.
bool valid_executor(const Executor* executor, Result& r) noexcept;
// The kernels of an instruction set; null, with status and message, if unavailable. `option` names
// the option that requested it.
const grid::Kernels* kernels_for(Isa isa, const char* option, Result& r) noexcept;

// Checks the options of every search on the CPU: executor, enumerations, cell scale, instruction
// set.
bool valid_search(const Options& options, Result& r) noexcept;

// Full check of a call; false, with status and message, if invalid. b null: one set.
bool valid(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept;
bool valid(const DoubleBoxes& a, const DoubleBoxes* b, const Options& options, Result& r) noexcept;
// The same for one set, with options already checked.
bool valid(const Boxes& set, Result& r) noexcept;

// The word for one element of a set and for several, for messages.
struct Noun {
  const char* one;
  const char* many;
};
// Checks the lengths, strides and worlds of the filters of `count` elements.
bool valid_filters(const Filters& filters, std::size_t count, const char* set, const Noun& noun,
                   Result& r) noexcept;

// The same without reading the worlds.
bool valid_filter_lengths(const Filters& filters, std::size_t count, const char* set,
                          const Noun& noun, Result& r) noexcept;

// The full check for boxes in device memory: values that need a read of the boxes are left to the
// device.
bool valid_on_device(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept;

// Checks that the array is not null unless empty, and that `which` is valid. False, with status and
// message, if not.
bool valid_sweeps(const Sweep* sweeps, std::size_t count, SweepHits which, Result& r) noexcept;

}  // namespace throng
