// The names of the public enumerations; those of instruction sets are in
// grid/sweep/select_kernels.cpp.
#include <throng/options.hpp>

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
    case Status::bad_mesh:
      return "bad mesh";
  }
  return "unknown";
}

}  // namespace throng
