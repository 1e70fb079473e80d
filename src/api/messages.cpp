#include "messages.hpp"

#include <cstdarg>
#include <cstdio>

namespace throng {

using ull = unsigned long long;

void set_message(Result& r, const char* format, ...) noexcept {
  std::va_list args;
  va_start(args, format);
  std::vsnprintf(r.message, sizeof r.message, format, args);
  va_end(args);
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
      set_message(r, "%llu pair%s; raise the capacity to that", ull{r.found},
                  r.found == 1 ? " does not fit" : "s do not fit");
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
