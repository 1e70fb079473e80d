// Shared by the parts of the C API: views, options, and how a call returns its result.
#pragma once

#include <throng/throng.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <new>
#include <type_traits>

#include <throng/boxes.hpp>
#include <throng/memory_resource.hpp>
#include <throng/mesh.hpp>
#include <throng/options.hpp>

namespace throng::c_api {

template <class T>
Strided<T> strided(const throng_strided& s, std::size_t count) noexcept {
  if (!s.data) return {};
  const std::size_t stride = s.stride_bytes == 0 ? sizeof(T) : s.stride_bytes;
  return {static_cast<const T*>(s.data), count, stride};
}

// The filters of throng_boxes, throng_double_boxes or throng_mesh, with `count` values each.
template <class C>
Filters filters_of(const C& c, std::size_t count) noexcept {
  Filters filters;
  filters.group = strided<std::uint32_t>(c.group, count);
  filters.mask = strided<std::uint32_t>(c.mask, count);
  filters.owner = strided<std::int32_t>(c.owner, count);
  filters.world = strided<std::int32_t>(c.world, count);
  filters.is_static = strided<std::uint8_t>(c.is_static, count);
  return filters;
}

// The stride of contiguous boxes: the number of values that are stored together.
template <class C>
std::size_t tight_stride(const C& c) noexcept {
  const int d = c.corner[2] ? 3 : 2;
  bool corners = c.corner[0] && c.corner[3], all = corners;
  for (int k = 0; k < d; ++k) {
    corners = corners && c.corner[k] == c.corner[0] + k && c.corner[3 + k] == c.corner[3] + k;
    all = all && corners && c.corner[3 + k] == c.corner[0] + d + k;
  }
  return sizeof(*c.corner[0]) * static_cast<std::size_t>(all ? 2 * d : corners ? d : 1);
}

// C is throng_boxes or throng_double_boxes.
template <class AnyBoxes, class C>
AnyBoxes view_as(const C& c) noexcept {
  using Box = typename AnyBoxes::Value;
  const std::size_t stride = c.stride_bytes == 0 ? tight_stride(c) : c.stride_bytes;
  // Packed boxes use the packed view, which is read faster.
  bool packed = c.corner[0] != nullptr && stride >= sizeof(Box);
  for (int k = 1; k < 6; ++k) packed = packed && c.corner[k] == c.corner[0] + k;
  AnyBoxes boxes = packed ? AnyBoxes(reinterpret_cast<const Box*>(c.corner[0]), c.count, stride)
                          : AnyBoxes::arrays(c.corner[0], c.corner[1], c.corner[2], c.corner[3],
                                             c.corner[4], c.corner[5], c.count, stride);
  boxes.filters = filters_of(c, c.count);
  return boxes;
}
inline Boxes view(const throng_boxes& c) noexcept { return view_as<Boxes>(c); }
inline DoubleBoxes view(const throng_double_boxes& c) noexcept { return view_as<DoubleBoxes>(c); }

// The caller's allocation functions as a memory resource.
class CallerMemory final : public std::pmr::memory_resource {
 public:
  explicit CallerMemory(const throng_options& options) noexcept : options_(options) {}

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    void* const p = options_.allocate(options_.memory_self, bytes, alignment);
    if (!p) throw std::bad_alloc();
    return p;
  }
  void do_deallocate(void* p, std::size_t bytes, std::size_t alignment) override {
    options_.deallocate(options_.memory_self, p, bytes, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  throng_options options_;
};

// The caller's options in the layout of this build. A shorter struct comes from an older caller:
// missing fields get their defaults. A longer one comes from a newer caller: unknown fields are
// dropped. Shorter than struct_bytes itself: not initialized.
inline throng_options complete_options(const throng_options* options) noexcept {
  throng_options given{};
  given.struct_bytes = sizeof given;
  if (options) {
    std::memcpy(&given, options, std::min(options->struct_bytes, sizeof given));
    given.struct_bytes = options->struct_bytes < sizeof options->struct_bytes ? 0 : sizeof given;
  }
  return given;
}

constexpr throng_result result_without_call(throng_status status, const char* message) noexcept {
  throng_result r{};
  r.struct_bytes = sizeof r;
  r.status = status;
  r.plan = "";
  r.message = message;
  return r;
}

// The base of every handle: the options converted to C++, and the result of the last call. Its
// options point into it, so it must not be moved.
class Handle {
 public:
  explicit Handle(const throng_options& given) noexcept : memory_(given) {
    const auto choose = [&](int value, int most, auto& field, const char* name) {
      if (value < 0 || value > most) {
        invalid_option_ = name;
        invalid_value_ = value;
      } else {
        field = static_cast<std::remove_reference_t<decltype(field)>>(value);
      }
    };
    int nothing = 0, stoppable = 0;
    choose(given.algorithm, THRONG_ALGORITHM_GRID, options_.algorithm, "algorithm");
    choose(given.order, THRONG_ORDER_CANONICAL, options_.order, "order");
    choose(given.backend, THRONG_BACKEND_EMULATED, options_.backend, "backend");
    choose(given.nan, THRONG_NAN_INACTIVE, options_.nan, "nan");
    choose(given.inverted, THRONG_INVERTED_INACTIVE, options_.inverted, "inverted");
    choose(given.isa, THRONG_ISA_WASM, options_.isa, "isa");
    choose(given.struct_bytes == 0, 0, nothing, "struct_bytes missing");
    choose(!given.allocate != !given.deallocate, 0, nothing, "one of allocate, deallocate missing");
    options_.margin = given.margin;
    options_.threads = given.threads;
    options_.memory_cap_bytes = given.memory_cap_bytes;
    if (given.run) {
      executor_ = {given.concurrency, given.run, given.run_self};
      options_.executor = &executor_;
    }
    if (given.allocate) options_.memory = &memory_;
    choose(given.stoppable, 1, stoppable, "stoppable");
    if (stoppable) options_.stop = &stop_;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  const Options& options() const noexcept { return options_; }
  const throng_result& result() const noexcept { return result_; }
  void stop() noexcept { stop_ = true; }

  // Runs call(), which returns a Result or MeshResult of the C++ API, if the options are valid, and
  // stores the result. `missing`: the name of a required argument that is NULL, or null.
  template <class Call>
  throng_status run_call(const char* missing, const Call& call) noexcept {
    // The stored result belongs to the other call.
    if (in_call_.exchange(true, std::memory_order_acquire)) return THRONG_BUSY;
    const CallGuard call_guard{in_call_};
    stop_ = false;
    result_.candidates = result_.exact_tests = 0;
    if (invalid_option_ || missing) {
      last_ = Result();
      refuse(missing);
    } else {
      try {
        store(call());
      } catch (...) {  // thrown by the consumer, if it is C++
        last_ = Result();
        last_.status = Status::stopped;
      }
    }
    result_.status = static_cast<throng_status>(last_.status);
    result_.found = last_.found;
    result_.written = last_.written;
    result_.inactive = last_.inactive;
    result_.comparisons = last_.comparisons;
    result_.first_invalid = last_.first_invalid;
    result_.invalid_count = last_.invalid_count;
    result_.bytes_needed = last_.bytes_needed;
    result_.total_ms = last_.times.total_ms;
    result_.plan_ms = last_.times.plan_ms;
    result_.bin_ms = last_.times.bin_ms;
    result_.find_ms = last_.times.find_ms;
    result_.order_ms = last_.times.order_ms;
    result_.plan = last_.plan.reason;
    result_.message = last_.message;
    result_.backend = static_cast<int>(last_.plan.backend);
    result_.algorithm = static_cast<int>(last_.plan.algorithm);
    result_.isa = static_cast<int>(last_.plan.isa);
    result_.threads = last_.plan.threads;
    result_.visited = last_.visited;
    return result_.status;
  }

 private:
  struct CallGuard {
    std::atomic<bool>& in_call;
    ~CallGuard() { in_call.store(false, std::memory_order_release); }
  };
  void store(const Result& r) noexcept { last_ = r; }
  void store(const MeshResult& r) noexcept {
    last_ = r;
    result_.candidates = r.candidates;
    result_.exact_tests = r.exact_tests;
  }
  void refuse(const char* missing) noexcept {
    if (invalid_option_) {
      last_.status = Status::bad_option;
      std::snprintf(
          last_.message, sizeof last_.message,
          "options: %s (%d); call throng_options_init first, then use the THRONG_ constants",
          invalid_option_, invalid_value_);
    } else {
      last_.status = Status::bad_boxes;
      std::snprintf(last_.message, sizeof last_.message,
                    "found no %s (NULL), which this call needs", missing);
    }
  }

  CallerMemory memory_;
  Executor executor_;
  Options options_;
  std::atomic<bool> stop_{false}, in_call_{false};
  const char* invalid_option_ = nullptr;  // the name of an invalid option
  int invalid_value_ = 0;
  Result last_;
  throng_result result_ = result_without_call(THRONG_OK, "");
};

// The result for an argument value that the C++ types cannot represent.
inline Result refused(Status status, const char* message) noexcept {
  Result r;
  r.status = status;
  std::snprintf(r.message, sizeof r.message, "%s", message);
  return r;
}
inline Result bad_option(const char* message) noexcept {
  return refused(Status::bad_option, message);
}

// Runs call() on a handle that may be NULL; `given`: the required argument `name` is not NULL.
template <class Call>
throng_status run_call(Handle* handle, bool given, const char* name, const Call& call) noexcept {
  return handle ? handle->run_call(given ? nullptr : name, call) : THRONG_OUT_OF_MEMORY;
}

inline const throng_result* result_of(const Handle* handle) noexcept {
  static constexpr throng_result none = result_without_call(
      THRONG_OUT_OF_MEMORY, "there is no handle (NULL): there was no memory to create one");
  return handle ? &handle->result() : &none;
}

}  // namespace throng::c_api
