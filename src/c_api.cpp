// The C door, over the C++ one.
#include <throng/throng.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory_resource>
#include <new>
#include <type_traits>

#include <throng/throng.hpp>
#include <throng/version.hpp>

namespace throng {
namespace {

constexpr bool same(throng_status c, Status cpp) noexcept {
  return static_cast<int>(c) == static_cast<int>(cpp);
}
static_assert(same(THRONG_OK, Status::ok) &&
              same(THRONG_BUFFER_TOO_SMALL, Status::buffer_too_small) &&
              same(THRONG_STOPPED, Status::stopped) && same(THRONG_NAN_BOX, Status::nan_box) &&
              same(THRONG_BAD_BOXES, Status::bad_boxes) &&
              same(THRONG_BAD_FILTER, Status::bad_filter) &&
              same(THRONG_BAD_OPTION, Status::bad_option) &&
              same(THRONG_TOO_MANY_BOXES, Status::too_many_boxes) &&
              same(THRONG_OUT_OF_MEMORY, Status::out_of_memory) &&
              same(THRONG_MEMORY_CAP_TOO_SMALL, Status::memory_cap_too_small) &&
              same(THRONG_UNSUPPORTED_ISA, Status::unsupported_isa) &&
              same(THRONG_NO_DEVICE, Status::no_device) &&
              same(THRONG_DEVICE_ERROR, Status::device_error));
static_assert(THRONG_ALGORITHM_GRID == static_cast<int>(Algorithm::grid) &&
              THRONG_ALGORITHM_ALL_PAIRS == static_cast<int>(Algorithm::all_pairs) &&
              THRONG_ORDER_CANONICAL == static_cast<int>(Order::canonical) &&
              THRONG_BACKEND_CPU == static_cast<int>(Backend::cpu) &&
              THRONG_BACKEND_CUDA == static_cast<int>(Backend::cuda) &&
              THRONG_BACKEND_EMULATED == static_cast<int>(Backend::emulated) &&
              THRONG_NAN_INACTIVE == static_cast<int>(NanPolicy::inactive));
static_assert(sizeof(throng_box) == sizeof(Box) && sizeof(throng_pair) == sizeof(Pair) &&
              alignof(throng_pair) == alignof(Pair));

template <class T>
Strided<T> strided(const throng_strided& s, std::size_t count) noexcept {
  return s.data ? Strided<T>{static_cast<const T*>(s.data), count, s.stride_bytes} : Strided<T>{};
}

Boxes view(const throng_boxes& c) noexcept {
  // Coordinates that lie together are read together.
  bool packed = c.corner[0] != nullptr && c.stride_bytes >= sizeof(Box);
  for (int k = 1; k < 6; ++k) packed = packed && c.corner[k] == c.corner[0] + k;
  Boxes boxes = packed ? Boxes(reinterpret_cast<const Box*>(c.corner[0]), c.count, c.stride_bytes)
                       : Boxes::arrays(c.corner[0], c.corner[1], c.corner[2], c.corner[3],
                                       c.corner[4], c.corner[5], c.count, c.stride_bytes);
  boxes.filters.group = strided<std::uint32_t>(c.group, c.count);
  boxes.filters.mask = strided<std::uint32_t>(c.mask, c.count);
  boxes.filters.owner = strided<std::int32_t>(c.owner, c.count);
  boxes.filters.world = strided<std::int32_t>(c.world, c.count);
  boxes.filters.is_static = strided<std::uint8_t>(c.is_static, c.count);
  return boxes;
}

// The caller's functions as a memory resource.
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

}  // namespace
}  // namespace throng

struct throng_finder {
  explicit throng_finder(const throng_options& given) noexcept : memory(given) {
    throng::Options options;
    const auto choose = [&](int value, int most, auto& field, const char* name) {
      if (value < 0 || value > most) {
        wrong = name;
        wrong_value = value;
      } else {
        field = static_cast<std::remove_reference_t<decltype(field)>>(value);
      }
    };
    choose(given.algorithm, THRONG_ALGORITHM_GRID, options.algorithm, "algorithm");
    choose(given.order, THRONG_ORDER_CANONICAL, options.order, "order");
    choose(given.backend, THRONG_BACKEND_EMULATED, options.backend, "backend");
    choose(given.nan, THRONG_NAN_INACTIVE, options.nan, "nan");
    choose(given.struct_bytes == 0, 0, initialised, "struct_bytes missing");
    choose(!given.allocate != !given.deallocate, 0, initialised,
           "one of allocate, deallocate missing");
    options.margin = given.margin;
    options.threads = given.threads;
    options.memory_cap_bytes = given.memory_cap_bytes;
    if (given.run) {
      executor = {given.concurrency, given.run, given.run_self};
      options.executor = &executor;
    }
    if (given.allocate) options.memory = &memory;
    finder.set_options(options);
  }

  // Runs call(), a Result of the C++ door, where the options are right, and keeps what it tells.
  template <class Call>
  throng_status answer(const throng_boxes* a, const Call& call) noexcept {
    if (wrong || !a) {
      last = throng::Result();
      last.status = wrong ? throng::Status::bad_option : throng::Status::bad_boxes;
      refuse();
    } else {
      try {
        last = call();
      } catch (...) {  // the consumer's, which may be C++ after all
        last = throng::Result();
        last.status = throng::Status::stopped;
      }
    }
    result.status = static_cast<throng_status>(last.status);
    result.found = last.found;
    result.written = last.written;
    result.inactive = last.inactive;
    result.comparisons = last.comparisons;
    result.first_invalid = last.first_invalid;
    result.invalid_count = last.invalid_count;
    result.bytes_needed = last.bytes_needed;
    result.total_ms = last.times.total_ms;
    result.plan_ms = last.times.plan_ms;
    result.bin_ms = last.times.bin_ms;
    result.find_ms = last.times.find_ms;
    result.order_ms = last.times.order_ms;
    result.plan = last.plan.reason;
    result.message = last.message;
    return result.status;
  }

  void refuse() noexcept {
    if (wrong) {
      std::snprintf(
          last.message, sizeof last.message,
          "options: %s (%d); call throng_options_init first, then use the THRONG_ constants", wrong,
          wrong_value);
    } else {
      std::snprintf(last.message, sizeof last.message,
                    "found no boxes (NULL); pass a throng_boxes");
    }
  }

  throng::CallerMemory memory;
  throng::Executor executor;
  throng::Finder finder;
  const char* wrong = nullptr;  // the name of an option that is wrong
  int wrong_value = 0, initialised = 0;
  throng::Result last;
  throng_result result{THRONG_OK, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, "", ""};
};

extern "C" {

throng_boxes throng_boxes_packed(const throng_box* boxes, size_t count) {
  throng_boxes b{};
  b.count = count;
  b.stride_bytes = sizeof(throng_box);
  for (int k = 0; k < 6; ++k) {
    b.corner[k] = boxes ? reinterpret_cast<const float*>(boxes) + k : nullptr;
  }
  return b;
}

throng_boxes throng_boxes_split(const float* lower, const float* upper, size_t count) {
  throng_boxes b{};
  b.count = count;
  b.stride_bytes = 3 * sizeof(float);
  for (int k = 0; k < 3; ++k) {
    b.corner[k] = lower ? lower + k : nullptr;
    b.corner[3 + k] = upper ? upper + k : nullptr;
  }
  return b;
}

void throng_options_init_sized(throng_options* options, size_t struct_bytes) {
  // A caller built against an older header has a shorter struct: what it does not know is left out.
  throng_options defaults{};
  defaults.struct_bytes = struct_bytes;
  std::memcpy(options, &defaults, std::min(struct_bytes, sizeof defaults));
}

throng_finder* throng_finder_create(const throng_options* options) {
  throng_options given{};
  given.struct_bytes = sizeof given;
  if (options) {
    const size_t known = std::min(options->struct_bytes, sizeof given);
    std::memcpy(&given, options, known);
    // Shorter: an older caller's. Longer: a newer one's, whose new fields are not known here.
    // Shorter than its first member: nobody's.
    given.struct_bytes = options->struct_bytes < sizeof options->struct_bytes ? 0 : sizeof given;
  }
  return new (std::nothrow) throng_finder(given);
}

void throng_finder_destroy(throng_finder* finder) { delete finder; }

throng_status throng_find(throng_finder* finder, const throng_boxes* a, const throng_boxes* b) {
  return finder->answer(a, [&] {
    return b ? finder->finder.find(throng::view(*a), throng::view(*b))
             : finder->finder.find(throng::view(*a));
  });
}

const throng_pair* throng_finder_pairs(const throng_finder* finder, size_t* count) {
  const throng::Pairs pairs = finder->finder.pairs();
  if (count) *count = pairs.size();
  return reinterpret_cast<const throng_pair*>(pairs.data());
}

throng_status throng_find_into(throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
                               throng_pair* out, size_t capacity) {
  auto* const pairs = reinterpret_cast<throng::Pair*>(out);
  return finder->answer(a, [&] {
    return b ? finder->finder.find(throng::view(*a), throng::view(*b), pairs, capacity)
             : finder->finder.find(throng::view(*a), pairs, capacity);
  });
}

throng_status throng_consume(throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
                             int (*consumer)(void* context, const throng_pair* pairs, size_t count),
                             void* context) {
  const auto take = [&](const throng::Pair* pairs, std::size_t count) {
    return consumer(context, reinterpret_cast<const throng_pair*>(pairs), count) != 0;
  };
  return finder->answer(a, [&] {
    return b ? finder->finder.consume(throng::view(*a), throng::view(*b), take)
             : finder->finder.consume(throng::view(*a), take);
  });
}

const throng_result* throng_finder_result(const throng_finder* finder) { return &finder->result; }

const char* throng_status_text(throng_status status) {
  return throng::to_string(static_cast<throng::Status>(status));
}

const char* throng_version(void) { return THRONG_VERSION; }
unsigned throng_c_version(void) { return THRONG_C_VERSION; }

}  // extern "C"
