// The hall: what is asked is checked, answered by a backend, and what went wrong is put into words.
#include <cmath>
#include <new>
#include <utility>

#include <throng/throng.hpp>

#include "core/bounds.hpp"
#include "cpu/engine.hpp"
#include "cpu/float_state.hpp"
#include "say.hpp"

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
    case Status::bad_bodies:
      return "bad bodies";
    case Status::bad_shape:
      return "bad shape";
  }
  return "unknown";
}

struct Finder::State {
  explicit State(std::pmr::memory_resource* memory) noexcept
      : resource(memory), engine(memory, sizeof(State)) {}
  std::pmr::memory_resource* resource;
  cpu::Engine engine;
};

namespace {

template <class T>
bool valid_length(const Strided<T>& filter, std::size_t boxes, const char* name, const char* set,
                  Result& r) noexcept {
  if (!filter || filter.count == boxes) return true;
  say(r, "filter '%s' of %s has %llu values for %llu boxes; give one value a box", name, set,
      ull{filter.count}, ull{boxes});
  return refuse(r, Status::bad_filter);
}

bool valid_boxes(const Boxes& boxes, const char* set, Result& r) noexcept {
  if (boxes.size() > max_box_count) {
    say(r, "%s has %llu boxes, at most %llu can be indexed; split them", set, ull{boxes.size()},
        ull{max_box_count});
    return refuse(r, Status::too_many_boxes);
  }
  if (!boxes.complete()) {
    say(r, "%s has %llu boxes but a coordinate array is null; only both z arrays may be missing",
        set, ull{boxes.size()});
    return refuse(r, Status::bad_boxes);
  }
  if (boxes.stride_bytes() % alignof(float) != 0) {
    say(r, "the stride of %s is %llu bytes; it must be a multiple of %llu", set,
        ull{boxes.stride_bytes()}, ull{alignof(float)});
    return refuse(r, Status::bad_boxes);
  }
  const Filters& f = boxes.filters;
  const std::size_t n = boxes.size();
  if (!valid_length(f.group, n, "group", set, r) || !valid_length(f.mask, n, "mask", set, r) ||
      !valid_length(f.owner, n, "owner", set, r) || !valid_length(f.world, n, "world", set, r) ||
      !valid_length(f.is_static, n, "static", set, r)) {
    return false;
  }
  if (!f.world) return true;
  for (std::size_t i = 0; i < n; ++i) {
    if (f.world[i] >= -1) continue;
    if (r.invalid_count++ == 0) r.first_invalid = i;
  }
  if (r.invalid_count == 0) return true;
  say(r,
      "%llu boxes of %s have a world below -1, the first is box %llu with world %d; use -1 for "
      "every world, 0 and up for one",
      ull{r.invalid_count}, set, ull{r.first_invalid}, f.world[r.first_invalid]);
  return refuse(r, Status::bad_filter);
}

bool valid(const Boxes& a, const Boxes* b, const Options& options, Result& r) noexcept {
  if (!(options.margin >= 0) || !std::isfinite(options.margin)) {
    say(r, "the margin is %g; it must be finite and not negative", double{options.margin});
    return refuse(r, Status::bad_option);
  }
  if (!cpu::find_kernels(options.isa)) {
    say(r, "instruction set '%s' is not to be had here (asked for by %s); use auto",
        options.isa == Isa::automatic ? "named" : to_string(options.isa),
        options.isa == Isa::automatic ? "THRONG_ISA" : "Options::isa");
    return refuse(r, Status::unsupported_isa);
  }
  return valid_boxes(a, b ? "the first set" : "the set", r) &&
         (!b || valid_boxes(*b, "the second set", r));
}

// Puts what the backend found wrong into words.
void explain(Result& r, const cpu::Engine& engine, bool two_sets) noexcept {
  const char* set = !two_sets                    ? ""
                    : engine.nan_in_second_set() ? " of the second set"
                                                 : " of the first set";
  switch (r.status) {
    case Status::nan_box:
      say(r,
          "%llu boxes have a NaN, the first is box %llu%s; mend them, or treat them as inactive "
          "by Options::nan",
          ull{r.invalid_count}, ull{r.first_invalid}, set);
      break;
    case Status::buffer_too_small:
      say(r, "%llu pairs do not fit; raise the capacity to that", ull{r.found});
      break;
    case Status::out_of_memory:
      say(r, "no memory: %llu bytes were asked for in vain", ull{r.bytes_needed});
      break;
    case Status::memory_cap_too_small:
      say(r, "the memory cap is too small; raise Options::memory_cap_bytes to %llu or more",
          ull{r.bytes_needed});
      break;
    default:
      break;
  }
}

}  // namespace

// What the public calls have in common.
struct FinderAccess {
  static Result run(Finder& finder, const Boxes& a, const Boxes* b, cpu::Output* output,
                    const Consumer* consumer) {
    const cpu::FloatState float_state;
    Result r;
    finder.pairs_ = {};
    if (!valid(a, b, finder.options_, r)) return r;
    if (!finder.state_) {
      std::pmr::memory_resource* memory = finder.options_.memory;
      if (!memory) memory = std::pmr::new_delete_resource();
      const std::size_t cap = consumer ? finder.options_.memory_cap_bytes : 0;
      void* room = nullptr;
      if (cap != 0 && cap < sizeof(Finder::State)) {
        // Not even that. The engine, asked without one byte to spare, knows what would do.
        alignas(Finder::State) unsigned char spot[sizeof(Finder::State)];
        auto* state = new (spot) Finder::State(memory);
        r = state->engine.find(a, b, finder.options_, output, consumer);
        explain(r, state->engine, b != nullptr);
        state->~State();
        return r;
      }
      try {
        room = memory->allocate(sizeof(Finder::State), alignof(Finder::State));
      } catch (...) {
      }
      if (!room) {
        r.status = Status::out_of_memory;
        r.bytes_needed = sizeof(Finder::State);
        say(r, "no memory: %llu bytes were asked for in vain", ull{r.bytes_needed});
        return r;
      }
      finder.state_ = new (room) Finder::State(memory);
    }
    cpu::Engine& engine = finder.state_->engine;
    cpu::Output own{engine.pairs().data(), engine.pairs().capacity(),
                    [](void* room, std::size_t count) {
                      return cpu::room_for_pairs(*static_cast<cpu::Buffer<Pair>*>(room), count);
                    },
                    &engine.pairs()};
    if (!output && !consumer) output = &own;
    r = engine.find(a, b, finder.options_, output, consumer);
    if (output == &own && r.ok()) finder.pairs_ = {own.data, static_cast<std::size_t>(r.found)};
    explain(r, engine, b != nullptr);
    return r;
  }
};

Finder::~Finder() {
  if (!state_) return;
  std::pmr::memory_resource* memory = state_->resource;
  state_->~State();
  memory->deallocate(state_, sizeof(State), alignof(State));
}
Finder::Finder(Finder&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)),
      options_(other.options_),
      pairs_(std::exchange(other.pairs_, {})) {}
Finder& Finder::operator=(Finder&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  std::swap(pairs_, other.pairs_);
  return *this;
}
std::size_t Finder::memory_bytes() const noexcept {
  return state_ ? state_->engine.memory().held() : 0;
}

Result Finder::find(const Boxes& boxes) noexcept {
  return FinderAccess::run(*this, boxes, nullptr, nullptr, nullptr);
}
Result Finder::find(const Boxes& a, const Boxes& b) noexcept {
  return FinderAccess::run(*this, a, &b, nullptr, nullptr);
}
Result Finder::find(const Boxes& boxes, Pair* out, std::size_t capacity) noexcept {
  cpu::Output output{out, out ? capacity : 0, nullptr, nullptr};
  return FinderAccess::run(*this, boxes, nullptr, &output, nullptr);
}
Result Finder::find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity) noexcept {
  cpu::Output output{out, out ? capacity : 0, nullptr, nullptr};
  return FinderAccess::run(*this, a, &b, &output, nullptr);
}
Result Finder::consume(const Boxes& boxes, Consumer consumer) {
  return FinderAccess::run(*this, boxes, nullptr, nullptr, &consumer);
}
Result Finder::consume(const Boxes& a, const Boxes& b, Consumer consumer) {
  return FinderAccess::run(*this, a, &b, nullptr, &consumer);
}

namespace {

Result find_into(const Boxes& a, const Boxes* b, std::vector<Pair>& out,
                 const Options& options) noexcept {
  Finder finder(options);
  cpu::Output output{out.data(), out.size(),
                     [](void* context, std::size_t count) -> Pair* {
                       auto& v = *static_cast<std::vector<Pair>*>(context);
                       try {
                         v.clear();
                         v.resize(count);
                       } catch (...) {
                         return nullptr;
                       }
                       return v.data();
                     },
                     &out};
  const Result r = FinderAccess::run(finder, a, b, &output, nullptr);
  out.resize(r.ok() ? static_cast<std::size_t>(r.found) : 0);  // never grows
  return r;
}

}  // namespace

Error::Error(const Result& result)
    : std::runtime_error(std::string("throng: ") + result.message), result_(result) {}

Result find_pairs(const Boxes& boxes, std::vector<Pair>& out, const Options& options) noexcept {
  return find_into(boxes, nullptr, out, options);
}
Result find_pairs(const Boxes& a, const Boxes& b, std::vector<Pair>& out,
                  const Options& options) noexcept {
  return find_into(a, &b, out, options);
}
std::vector<Pair> find_pairs(const Boxes& boxes, const Options& options) {
  std::vector<Pair> pairs;
  const Result r = find_into(boxes, nullptr, pairs, options);
  if (!r.ok()) throw Error(r);
  return pairs;
}
std::vector<Pair> find_pairs(const Boxes& a, const Boxes& b, const Options& options) {
  std::vector<Pair> pairs;
  const Result r = find_into(a, &b, pairs, options);
  if (!r.ok()) throw Error(r);
  return pairs;
}

Box round_outward(const double lower[3], const double upper[3]) noexcept {
  const cpu::FloatState float_state;
  const auto down = [](double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) > x ? core::next_down(f) : f;
  };
  const auto up = [&](double x) { return -down(-x); };
  return {{down(lower[0]), down(lower[1]), down(lower[2])},
          {up(upper[0]), up(upper[1]), up(upper[2])}};
}

}  // namespace throng
