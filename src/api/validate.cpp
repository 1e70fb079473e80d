#include "validate.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iterator>

#include "grid/sweep/kernel_table.hpp"

namespace throng {

using ull = unsigned long long;

namespace {

template <class T>
bool valid_filter(const Strided<T>& filter, std::size_t count, const char* name, const char* set,
                  const Noun& noun, Result& r) noexcept {
  if (!filter) return true;
  if (filter.count != count) {
    set_message(r, "filter '%s' of %s has %llu values for %llu %s; give one value per %s", name,
                set, ull{filter.count}, ull{count}, noun.many, noun.one);
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
  return true;
}

bool valid_lengths(const Filters& f, std::size_t n, const char* set, const Noun& noun,
                   Result& r) noexcept {
  return valid_filter(f.group, n, "group", set, noun, r) &&
         valid_filter(f.mask, n, "mask", set, noun, r) &&
         valid_filter(f.owner, n, "owner", set, noun, r) &&
         valid_filter(f.world, n, "world", set, noun, r) &&
         valid_filter(f.is_static, n, "static", set, noun, r);
}

bool valid_worlds(const Filters& f, std::size_t n, const char* set, const Noun& noun,
                  Result& r) noexcept {
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
  set_message(r,
              "%llu %s of %s have a world below -1, the first is %s %llu with world %d; use -1 for "
              "every world, 0 and up for one",
              ull{r.invalid_count}, noun.many, set, noun.one, ull{r.first_invalid},
              f.world[r.first_invalid]);
  return refuse(r, Status::bad_filter);
}

constexpr Noun box_noun = {"box", "boxes"};

template <class Real>
bool valid_lengths(const BasicBoxes<Real>& boxes, const char* set, Result& r) noexcept {
  return valid_lengths(boxes.filters, boxes.size(), set, box_noun, r);
}
template <class Real>
bool valid_set(const BasicBoxes<Real>& boxes, const char* set, Result& r) noexcept {
  return valid_boxes(boxes, set, r) && valid_filters(boxes.filters, boxes.size(), set, box_noun, r);
}

}  // namespace

bool valid_filter_lengths(const Filters& filters, std::size_t count, const char* set,
                          const Noun& noun, Result& r) noexcept {
  return valid_lengths(filters, count, set, noun, r);
}

bool valid_filters(const Filters& filters, std::size_t count, const char* set, const Noun& noun,
                   Result& r) noexcept {
  return valid_lengths(filters, count, set, noun, r) && valid_worlds(filters, count, set, noun, r);
}

bool valid_margin(float margin, Result& r) noexcept {
  if (margin >= 0 && std::isfinite(margin)) return true;
  set_message(r, "the margin is %g; it must be finite and not negative", double{margin});
  return refuse(r, Status::bad_option);
}

bool valid_cell_scale(float scale, Result& r) noexcept {
  if (scale >= 1 / 64.0f && scale <= 64) return true;
  set_message(r,
              "the cell scale is %g; it must be within 1/64 and 64, 1 for the planner's own cells",
              double{scale});
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

// THRONG_ISA does not name an available instruction set.
void set_forced_isa_message(Result& r) noexcept {
  char here[64] = "auto";
  std::size_t length = 4;
  for (const Isa isa : all_isas) {
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
         valid_choice(options.isa, *std::rbegin(all_isas), "Options::isa", r);
}

bool valid_executor(const Executor* executor, Result& r) noexcept {
  if (!executor || executor->run) return true;
  set_message(r, "the executor has no function that runs tasks; set Executor::run");
  return refuse(r, Status::bad_option);
}

const grid::Kernels* kernels_for(Isa isa, const char* option, Result& r) noexcept {
  if (!valid_choice(isa, *std::rbegin(all_isas), option, r)) return nullptr;
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
         valid_lengths(a, b ? "the first set" : "the set", r) &&
         (!b || (valid_boxes(*b, "the second set", r) && valid_lengths(*b, "the second set", r)));
}

bool valid(const Boxes& set, Result& r) noexcept { return valid_set(set, "the set", r); }

bool valid_search(const Options& options, Result& r) noexcept {
  return valid_executor(options.executor, r) && valid_choices(options, r) &&
         valid_cell_scale(options.cell_scale, r) && kernels_for(options.isa, "Options::isa", r);
}

namespace {

template <class AnyBoxes>
bool valid_call(const AnyBoxes& a, const AnyBoxes* b, const Options& options, Result& r) noexcept {
  if (!valid_margin(options.margin, r) || !valid_search(options, r)) return false;
  if (!b) return valid_set(a, "the set", r);
  return valid_set(a, "the first set", r) && valid_set(*b, "the second set", r);
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

}  // namespace throng
