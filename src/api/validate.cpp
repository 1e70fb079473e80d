#include "validate.hpp"

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "grid/sweep/kernel_table.hpp"

namespace throng {

const char* to_string(Algorithm algorithm) noexcept {
  switch (algorithm) {
    case Algorithm::automatic:
      return "auto";
    case Algorithm::all_pairs:
      return "all-pairs";
    case Algorithm::grid:
      return "grid";
  }
  return "unknown";
}

const char* to_string(Backend backend) noexcept {
  switch (backend) {
    case Backend::automatic:
      return "auto";
    case Backend::cpu:
      return "cpu";
    case Backend::cuda:
      return "cuda";
    case Backend::emulated:
      return "emulated";
  }
  return "unknown";
}

const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::buffer_too_small:
      return "buffer too small";
    case Status::stopped:
      return "stopped";
    case Status::nan_box:
      return "NaN box";
    case Status::bad_boxes:
      return "bad boxes";
    case Status::bad_filter:
      return "bad filter";
    case Status::bad_option:
      return "bad option";
    case Status::too_many_boxes:
      return "too many boxes";
    case Status::out_of_memory:
      return "out of memory";
    case Status::memory_cap_too_small:
      return "memory cap too small";
    case Status::unsupported_isa:
      return "unsupported instruction set";
    case Status::no_device:
      return "no device";
    case Status::device_error:
      return "device error";
    case Status::not_reserved:
      return "not reserved";
    case Status::bad_bodies:
      return "bad bodies";
    case Status::bad_shape:
      return "bad shape";
    case Status::bad_id:
      return "bad id";
    case Status::busy:
      return "busy";
    case Status::ranks_disagree:
      return "ranks disagree";
    case Status::rank_failed:
      return "rank failed";
    case Status::inverted_box:
      return "inverted box";
  }
  return "unknown";
}

using ull = unsigned long long;

void set_message(Result& r, const char* format, ...) noexcept {
  std::va_list args;
  va_start(args, format);
  std::vsnprintf(r.message, sizeof r.message, format, args);
  va_end(args);
}

namespace {

template <class T>
bool valid_filter(const Strided<T>& filter, std::size_t boxes, const char* name, const char* set,
                  Result& r) noexcept {
  if (!filter) return true;
  if (filter.count != boxes) {
    set_message(r, "filter '%s' of %s has %llu values for %llu boxes; give one value per box", name,
                set, ull{filter.count}, ull{boxes});
  } else if (filter.stride_bytes % alignof(T) != 0) {
    set_message(r, "the stride of filter '%s' of %s is %llu bytes; it must be a multiple of %llu",
                name, set, ull{filter.stride_bytes}, ull{alignof(T)});
  } else {
    return true;
  }
  return refuse(r, Status::bad_filter);
}

template <class Real>
bool valid_boxes(const BasicBoxes<Real>& boxes, const char* set, Result& r) noexcept {
  if (boxes.size() > max_box_count) {
    set_message(r, "%s has %llu boxes, at most %llu can be indexed; split them", set,
                ull{boxes.size()}, ull{max_box_count});
    return refuse(r, Status::too_many_boxes);
  }
  if (!boxes.complete()) {
    set_message(
        r, "%s has %llu boxes but a coordinate array is null; only both z arrays may be missing",
        set, ull{boxes.size()});
    return refuse(r, Status::bad_boxes);
  }
  if (boxes.stride_bytes() % alignof(Real) != 0) {
    set_message(r, "the stride of %s is %llu bytes; it must be a multiple of %llu", set,
                ull{boxes.stride_bytes()}, ull{alignof(Real)});
    return refuse(r, Status::bad_boxes);
  }
  const Filters& f = boxes.filters;
  const std::size_t n = boxes.size();
  if (!valid_filter(f.group, n, "group", set, r) || !valid_filter(f.mask, n, "mask", set, r) ||
      !valid_filter(f.owner, n, "owner", set, r) || !valid_filter(f.world, n, "world", set, r) ||
      !valid_filter(f.is_static, n, "static", set, r)) {
    return false;
  }
  return true;
}

template <class Real>
bool valid_worlds(const BasicBoxes<Real>& boxes, const char* set, Result& r) noexcept {
  const Filters& f = boxes.filters;
  const std::size_t n = boxes.size();
  if (!f.world) return true;
  // One pass over all values without branches: world + 1 is negative for values below -1, and for
  // the largest int. The exact pass is needed only if the OR has the sign bit.
  std::uint32_t signs = 0;
  for (std::size_t i = 0; i < n; ++i) signs |= static_cast<std::uint32_t>(f.world[i]) + 1;
  if (signs >> 31 == 0) return true;
  for (std::size_t i = 0; i < n; ++i) {
    if (f.world[i] >= -1) continue;
    if (r.invalid_count++ == 0) r.first_invalid = i;
  }
  if (r.invalid_count == 0) return true;
  set_message(
      r,
      "%llu boxes of %s have a world below -1, the first is box %llu with world %d; use -1 for "
      "every world, 0 and up for one",
      ull{r.invalid_count}, set, ull{r.first_invalid}, f.world[r.first_invalid]);
  return refuse(r, Status::bad_filter);
}

}  // namespace

bool valid_margin(float margin, Result& r) noexcept {
  if (margin >= 0 && std::isfinite(margin)) return true;
  set_message(r, "the margin is %g; it must be finite and not negative", double{margin});
  return refuse(r, Status::bad_option);
}

namespace {

template <class Enum>
bool valid_choice(Enum value, Enum last, const char* option, Result& r) noexcept {
  if (value <= last) return true;
  set_message(r, "%s is %d, which is not one of its constants; use one, or keep the default",
              option, static_cast<int>(value));
  return refuse(r, Status::bad_option);
}

bool valid_cell_scale(float scale, Result& r) noexcept {
  if (scale >= 1 / 64.0f && scale <= 64) return true;
  set_message(r,
              "the cell scale is %g; it must be within 1/64 and 64, 1 for the planner's own cells",
              double{scale});
  return refuse(r, Status::bad_option);
}

// THRONG_ISA does not name an available instruction set.
void set_forced_isa_message(Result& r) noexcept {
  char here[64] = "auto";
  std::size_t length = 4;
  for (const Isa isa : {Isa::scalar, Isa::sse4, Isa::avx2, Isa::avx512, Isa::neon}) {
    if (!grid::find_kernels(isa)) continue;
    length += static_cast<std::size_t>(
        std::snprintf(here + length, sizeof here - length, ", %s", to_string(isa)));
  }
  const char* const name = std::getenv("THRONG_ISA");
  set_message(
      r,
      "the environment variable THRONG_ISA is '%.40s', which is not an instruction set available "
      "here; "
      "unset it, or set it to one of: %s",
      name ? name : "", here);
}

}  // namespace

bool valid_choices(const Options& options, Result& r) noexcept {
  return valid_choice(options.algorithm, Algorithm::grid, "Options::algorithm", r) &&
         valid_choice(options.order, Order::canonical, "Options::order", r) &&
         valid_choice(options.backend, Backend::emulated, "Options::backend", r) &&
         valid_choice(options.nan, NanPolicy::inactive, "Options::nan", r) &&
         valid_choice(options.inverted, InvertedPolicy::inactive, "Options::inverted", r) &&
         valid_choice(options.isa, Isa::neon, "Options::isa", r);
}

bool valid_executor(const Executor* executor, Result& r) noexcept {
  if (!executor || executor->run) return true;
  set_message(r, "the executor has no function that runs tasks; set Executor::run");
  return refuse(r, Status::bad_option);
}

const grid::Kernels* kernels_for(Isa isa, const char* option, Result& r) noexcept {
  if (!valid_choice(isa, Isa::neon, option, r)) return nullptr;
  const grid::Kernels* kernels = grid::find_kernels(isa);
  if (kernels) return kernels;
  if (isa == Isa::automatic)
    set_forced_isa_message(r);
  else
    set_message(r, "instruction set '%s' is not available here (requested by %s); use auto",
                to_string(isa), option);
  refuse(r, Status::unsupported_isa);
  return nullptr;
}

bool valid_on_device(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept {
  return valid_choices(options, r) && valid_margin(options.margin, r) &&
         valid_cell_scale(options.cell_scale, r) &&
         valid_boxes(a, b ? "the first set" : "the set", r) &&
         (!b || valid_boxes(*b, "the second set", r));
}

bool valid(const Boxes& set, Result& r) noexcept {
  return valid_boxes(set, "the set", r) && valid_worlds(set, "the set", r);
}

namespace {

template <class AnyBoxes>
bool valid_call(const AnyBoxes& a, const AnyBoxes* b, const Options& options, Result& r) noexcept {
  if (!valid_executor(options.executor, r) || !valid_choices(options, r) ||
      !valid_margin(options.margin, r) || !valid_cell_scale(options.cell_scale, r) ||
      !kernels_for(options.isa, "Options::isa", r))
    return false;
  if (!b) return valid_boxes(a, "the set", r) && valid_worlds(a, "the set", r);
  return valid_boxes(a, "the first set", r) && valid_worlds(a, "the first set", r) &&
         valid_boxes(*b, "the second set", r) && valid_worlds(*b, "the second set", r);
}

}  // namespace

bool valid(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept {
  return valid_call(a, b, options, r);
}
bool valid(const DoubleBoxes& a, const DoubleBoxes* b, const Options& options, Result& r) noexcept {
  return valid_call(a, b, options, r) && valid_on_cpu(options, "boxes of doubles are searched", r);
}

bool valid_on_cpu(const Options& options, const char* what, Result& r) noexcept {
  if (options.backend != Backend::cuda && options.backend != Backend::emulated) return true;
  set_message(r, "backend %s: %s on the CPU alone; set backend to cpu or automatic",
              to_string(options.backend), what);
  return refuse(r, Status::bad_option);
}

void* allocate_state(std::pmr::memory_resource& memory, std::size_t bytes, std::size_t alignment,
                     Result& r) noexcept {
  try {
    if (void* block = memory.allocate(bytes, alignment)) return block;
  } catch (...) {
  }
  explain_failure(r, {Status::out_of_memory, bytes});
  return nullptr;
}

namespace {

void set_out_of_memory_message(Result& r, const char* remedy) noexcept {
  set_message(r, "out of memory: allocating %llu bytes failed; %s", ull{r.bytes_needed}, remedy);
}

}  // namespace

void explain_failure(Result& r, const device::Failure& failure, const char* if_no_memory) noexcept {
  r.status = failure.status;
  r.found = r.written = r.bytes_needed = 0;
  const char* text = failure.text ? failure.text : "";
  const char* what = failure.what ? failure.what : "";
  const ull number{failure.bytes};
  switch (failure.status) {
    case Status::no_device:
      if (failure.text)
        set_message(r, "no GPU can be used: %s; use Backend::cpu", text);
      else
        set_message(
            r, "this build has no GPU backend; use Backend::cpu, or build with THRONG_CUDA=ON");
      break;
    case Status::device_error:
      set_message(
          r,
          "the GPU failed: %s; its memory may be lost: create a new Finder, and if that fails, "
          "too, restart the process",
          text);
      break;
    case Status::not_reserved:
      set_message(
          r,
          "%llu boxes, or the capacity under canonical order, exceed what was reserved; call "
          "reserve() first",
          number);
      break;
    case Status::too_many_boxes:
      set_message(r, "%llu boxes are more than a device takes, of both sets together; split them",
                  number);
      break;
    case Status::bad_boxes:
    case Status::bad_filter:
    case Status::bad_option:
      set_message(r,
                  "%s %s; give aligned device memory of the Finder's device, or use throng::Finder",
                  what, text);
      break;
    case Status::bad_bodies:
      set_message(
          r,
          "%s %s; give aligned device memory of the stream's device, or use throng::update_boxes",
          what, text);
      break;
    case Status::out_of_memory:
      r.bytes_needed = number;
      if (!failure.text) return set_out_of_memory_message(r, if_no_memory);
      if (number)
        set_message(r, "out of device memory: allocating %llu bytes failed (%s); %s", number, text,
                    if_no_memory);
      else
        set_message(r, "out of device memory: %s; %s", text, if_no_memory);
      break;
    case Status::memory_cap_too_small:
      r.bytes_needed = number;
      break;
    default:
      break;
  }
}

bool valid_sweeps(const Sweep* sweeps, std::size_t count, SweepHits which, Result& r) noexcept {
  if (which > SweepHits::first) {
    set_message(r, "SweepHits is %d, which is not one of its constants; use one",
                static_cast<int>(which));
    return refuse(r, Status::bad_option);
  }
  if (sweeps || count == 0) return true;
  set_message(r, "the array of sweeps is null; give its address, with %llu sweeps", ull{count});
  return refuse(r, Status::bad_boxes);
}
void explain_sweeps(Result& r) noexcept {
  set_message(
      r,
      "%llu sweeps have a NaN or an infinite direction, the first is sweep %llu; instead of "
      "infinity "
      "give a length beyond the scene, as 1e30 (at most 3.4e38 a component): it finds the same "
      "hits",
      ull{r.invalid_count}, ull{r.first_invalid});
}

void explain(Result& r, bool two_sets, bool nan_in_second_set, const char* if_no_memory) noexcept {
  if (r.message[0]) return;  // the device has set the message
  const char* set = !two_sets ? "" : nan_in_second_set ? " of the second set" : " of the first set";
  switch (r.status) {
    case Status::nan_box:
      set_message(
          r,
          "%llu boxes have a NaN, the first is box %llu%s; fix them, or treat them as inactive "
          "by Options::nan",
          ull{r.invalid_count}, ull{r.first_invalid}, set);
      break;
    case Status::bad_filter:
      set_message(
          r,
          "%llu boxes have a world below -1, the first is box %llu; use -1 for every world, 0 and "
          "up for one",
          ull{r.invalid_count}, ull{r.first_invalid});
      break;
    case Status::bad_id:
      set_message(
          r,
          "%llu ids are not valid, the first is at index %llu of the list: it is not alive, or "
          "occurs "
          "twice; give each id returned by add() once",
          ull{r.invalid_count}, ull{r.first_invalid});
      break;
    case Status::buffer_too_small:
      set_message(r, "%llu pairs do not fit; raise the capacity to that", ull{r.found});
      break;
    case Status::out_of_memory:
      set_out_of_memory_message(r, if_no_memory);
      break;
    case Status::bad_shape:
      set_message(r, "%llu bodies have an invalid shape, the first is body %llu; fix it",
                  ull{r.invalid_count}, ull{r.first_invalid});
      break;
    case Status::memory_cap_too_small:
      set_message(r, "the memory cap is too small; raise Options::memory_cap_bytes to %llu or more",
                  ull{r.bytes_needed});
      break;
    default:
      break;
  }
}

}  // namespace throng
