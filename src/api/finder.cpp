// Finder: checks arguments, dispatches to a backend, and turns failures into messages.
#include <atomic>
#include <memory>
#include <new>
#include <utility>

#include <throng/throng.hpp>

#include "backend_chooser.hpp"
#include "base/float_state.hpp"
#include "base/large_pages.hpp"
#include "base/threads.hpp"
#include "capture/log.hpp"
#include "cuda/backend.hpp"
#include "device/emulated.hpp"
#include "explanation.hpp"
#include "finder_access.hpp"
#include "grid/engine.hpp"
#include "inverted_boxes.hpp"
#include "validate.hpp"

namespace throng {

// The memory of each backend that the Finder has used.
struct Finder::State {
  explicit State(std::pmr::memory_resource* memory) noexcept
      : resource(memory),
        cpu(memory, sizeof(State)),
        emulated(memory, device::HostDevice::Run{base::run_tasks}) {}

  std::size_t held() noexcept {
    return cpu.memory().held() + emulated.held() + (gpu ? gpu->held() : 0);
  }

  template <class AnyBoxes>
  Result find_on_cpu(const AnyBoxes& a, const AnyBoxes* b, const Options& options,
                     base::Output* output, const Consumer* consumer) {
    const std::size_t before = cpu.memory().held();
    Result r = cpu.find(a, b, options, output, consumer);
    // Memory kept from other searches may be what exceeds the cap.
    if (r.status == Status::memory_cap_too_small && r.written == 0 && before > sizeof(State)) {
      std::destroy_at(&cpu);
      std::construct_at(&cpu, resource, sizeof(State));
      r = cpu.find(a, b, options, output, consumer);
    }
    return r;
  }

  static const char* if_no_memory(const Consumer* consumer) noexcept {
    return consumer ? "free some, or split the boxes"
                    : "take pairs in blocks by Finder::consume, or split the boxes";
  }

  // Boxes of doubles are searched on the CPU only.
  Result find(const DoubleBoxes& a, const DoubleBoxes* b, const Options& options,
              base::Output* output, const Consumer* consumer) {
    Result r = find_on_cpu(a, b, options, output, consumer);
    throng::explain(r, b != nullptr, cpu.nan_in_second_set(), if_no_memory(consumer));
    return r;
  }

  Result find(const Boxes& a, const Boxes* b, const Options& options, base::Output* output,
              const Consumer* consumer) {
    Result r;
    bool nan_in_second = false;
    const std::size_t boxes = a.size() + (b ? b->size() : 0);
    if (options.backend == Backend::emulated) {
      find_emulated(a, b, options, output, consumer, r);
      nan_in_second = emulated.nan_in_second_set();
    } else if (options.backend == Backend::cuda ||
               (cuda::is_built() && backend_chooser.should_try_gpu(boxes, options))) {
      nan_in_second = find_on_gpu(a, b, options, output, consumer, r);
    }
    // Fall back to the CPU if an automatic choice tried a GPU that fails, unless the consumer has
    // already been given pairs.
    const bool tried = r.plan.backend != Backend::cpu;
    if (!tried || (options.backend == Backend::automatic && !delivered &&
                   backend_chooser.should_fall_back(r))) {
      if (tried) gpu.reset();
      r = find_on_cpu(a, b, options, output, consumer);
      nan_in_second = cpu.nan_in_second_set();
      if (options.backend == Backend::automatic && backend_chooser.reason(boxes))
        r.plan.reason = backend_chooser.reason(boxes);
    }
    throng::explain(r, b != nullptr, nan_in_second, if_no_memory(consumer));
    return r;
  }

  void find_emulated(const Boxes& a, const Boxes* b, const Options& options, base::Output* output,
                     const Consumer* consumer, Result& r) {
    r.plan.backend = Backend::emulated;
    r.plan.isa = Isa::scalar;
    r.plan.threads = base::threads_of(options);
    cpu.memory().set_cap(0);  // the pairs may be stored there; the pipeline enforces the cap
    try {
      run_unless_stopped(options, [&] {
        device::find_emulated(emulated, a, b, options, cpu.memory().held(), output, consumer, r);
      });
    } catch (const device::Failure& failure) {
      explain_failure(r, failure, if_no_memory(consumer));
    }
  }

  // Throws Failure{stopped} if the stop flag is set before or after find().
  template <class F>
  static void run_unless_stopped(const Options& options, const F& find) {
    const auto throw_if_stopped = [&] {
      if (options.stop && options.stop->load()) throw device::Failure{Status::stopped};
    };
    throw_if_stopped();
    find();
    throw_if_stopped();
  }

  // Returns whether the second set has a NaN.
  bool find_on_gpu(const Boxes& a, const Boxes* b, const Options& options, base::Output* output,
                   const Consumer* consumer, Result& r) {
    r.plan.backend = Backend::cuda;
    r.plan.isa = Isa::scalar;
    cpu.memory().set_cap(0);
    delivered = false;
    try {
      run_unless_stopped(options, [&] {
        if (!gpu) gpu.reset(cuda::create({}));
        gpu->find(a, b, options, cpu.memory().held(), output, consumer, r);
      });
      return gpu->nan_in_second_set();
    } catch (const device::Failure& failure) {
      delivered = consumer && r.written != 0;
      explain_failure(r, failure, if_no_memory(consumer));
    }
    return false;
  }

  std::pmr::memory_resource* resource;
  grid::Engine cpu;
  device::EmulatedEngine emulated;
  std::unique_ptr<cuda::Engine> gpu;
  bool delivered = false;  // the consumer was given pairs before the GPU failed
  BackendChooser backend_chooser;
};

template <class AnyBoxes>
Result FinderAccess::run(Finder& finder, const AnyBoxes& a, const AnyBoxes* b, base::Output* output,
                         const Consumer* consumer) {
  const base::FloatState float_state;
  Result r;
  finder.pairs_ = {};
  if (!valid(a, b, finder.options_, r)) return r;
  const bool refuses = finder.options_.inverted == InvertedPolicy::refuse;
  // Checked before the search: a consumer would be given pairs before the search counts such boxes.
  if (refuses && consumer && !check_not_inverted(a, b, r)) return r;
  r = capture_or_search(finder, a, b, output, consumer);
  // Checked afterwards, and only if some box is inactive, so that valid boxes are not read twice. A
  // wrong layout can also give more pairs than memory holds.
  if (refuses && (r.inactive != 0 || r.status == Status::out_of_memory)) {
    Result refused;
    if (!check_not_inverted(a, b, refused)) {
      finder.pairs_ = {};
      return refused;
    }
  }
  return r;
}

template <class AnyBoxes>
Result FinderAccess::capture_or_search(Finder& finder, const AnyBoxes& a, const AnyBoxes* b,
                                       base::Output* output, const Consumer* consumer) {
  if constexpr (AnyBoxes::is_float) {
    if (const char* folder = capture::folder_of(finder.options_))
      return captured(folder, finder, a, b, output, consumer);
  }
  return search(finder, a, b, output, consumer);
}

// search(), with its input and result written to a capture file.
Result FinderAccess::captured(const char* folder, Finder& finder, const Boxes& a, const Boxes* b,
                              base::Output* output, const Consumer* consumer) {
  const capture::Form form = consumer                  ? capture::Form::consumer
                             : output && !output->grow ? capture::Form::buffer
                                                       : capture::Form::growing;
  capture::Log log;
  log.open(folder, finder.options_);
  log.begin(capture::Operation::find, b ? 2 : 1,
            form == capture::Form::buffer ? output->capacity : 0, static_cast<std::uint32_t>(form));
  log.boxes(a);
  if (b) log.boxes(*b);
  std::atomic<std::uint64_t> sum{0};
  const auto count_in = [&](const Pair* pairs, std::size_t count) {
    sum += pair_checksum(pairs, count);
    return (*consumer)(pairs, count);
  };
  const Consumer counting(count_in);
  Result r = search(finder, a, b, output, consumer ? &counting : nullptr);
  if (output)
    sum = pair_checksum(output->data, static_cast<std::size_t>(r.written));
  else if (!consumer)
    sum = pair_checksum(finder.pairs_.data(), finder.pairs_.size());
  log.set_checksum(sum);
  log.answer(r);
  return r;
}

template <class AnyBoxes>
Result FinderAccess::search(Finder& finder, const AnyBoxes& a, const AnyBoxes* b,
                            base::Output* output, const Consumer* consumer) {
  Result r;
  if (!finder.state_) {
    std::pmr::memory_resource* memory = finder.options_.memory;
    if (!memory) memory = base::large_blocks();
    const std::size_t cap = consumer ? finder.options_.memory_cap_bytes : 0;
    if (cap != 0 && cap < sizeof(Finder::State)) {
      // The cap is smaller than the state itself. The backend, called with no byte to spare,
      // reports the number of bytes needed.
      alignas(Finder::State) unsigned char storage[sizeof(Finder::State)];
      auto* state = new (storage) Finder::State(memory);
      r = state->find(a, b, finder.options_, output, consumer);
      state->~State();
      return r;
    }
    void* block = allocate_state(*memory, sizeof(Finder::State), alignof(Finder::State), r);
    if (!block) return r;
    finder.state_ = new (block) Finder::State(memory);
  }
  const base::Buffer<Pair>& pairs = finder.state_->cpu.pairs();
  base::Output own{pairs.data(), pairs.capacity(), grow_pairs, &finder};
  if (!output && !consumer) output = &own;
  r = finder.state_->find(a, b, finder.options_, output, consumer);
  if (output == &own && r.ok()) finder.pairs_ = {own.data, static_cast<std::size_t>(r.found)};
  return r;
}

Pair* FinderAccess::grow_pairs(void* finder, std::size_t count) noexcept {
  return grid::grow_pairs(&static_cast<Finder*>(finder)->state_->cpu.pairs(), count);
}

Explanation FinderAccess::explain(Finder& finder, const Boxes& a, const Boxes* b) {
  const Options& options = finder.options_;
  Result r;
  if (!valid_choices(options, r) || !valid_on_cpu(options, "a search is explained", r))
    throw Error(r);
  const Backend requested = options.backend;
  finder.options_.backend = Backend::cpu;
  r = run<Boxes>(finder, a, b, nullptr, nullptr);
  finder.options_.backend = requested;
  if (!r.ok()) throw Error(r);
  return make_explanation(a, b, options, r, finder.state_->cpu);
}

template Result FinderAccess::run(Finder&, const Boxes&, const Boxes*, base::Output*,
                                  const Consumer*);
template Result FinderAccess::run(Finder&, const DoubleBoxes&, const DoubleBoxes*, base::Output*,
                                  const Consumer*);

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
std::size_t Finder::memory_bytes() const noexcept { return state_ ? state_->held() : 0; }

namespace {

base::Output into(Pair* out, std::size_t capacity) noexcept {
  return {out, out ? capacity : 0, nullptr, nullptr};
}

}  // namespace

Result Finder::find(const Boxes& boxes) noexcept {
  return FinderAccess::run<Boxes>(*this, boxes, nullptr, nullptr, nullptr);
}
Result Finder::find(const Boxes& a, const Boxes& b) noexcept {
  return FinderAccess::run<Boxes>(*this, a, &b, nullptr, nullptr);
}
Result Finder::find(const Boxes& boxes, Pair* out, std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return FinderAccess::run<Boxes>(*this, boxes, nullptr, &output, nullptr);
}
Result Finder::find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return FinderAccess::run<Boxes>(*this, a, &b, &output, nullptr);
}
Result Finder::consume(const Boxes& boxes, Consumer consumer) {
  return FinderAccess::run<Boxes>(*this, boxes, nullptr, nullptr, &consumer);
}
Result Finder::consume(const Boxes& a, const Boxes& b, Consumer consumer) {
  return FinderAccess::run<Boxes>(*this, a, &b, nullptr, &consumer);
}

Result Finder::find(const DoubleBoxes& boxes) noexcept {
  return FinderAccess::run<DoubleBoxes>(*this, boxes, nullptr, nullptr, nullptr);
}
Result Finder::find(const DoubleBoxes& a, const DoubleBoxes& b) noexcept {
  return FinderAccess::run<DoubleBoxes>(*this, a, &b, nullptr, nullptr);
}
Result Finder::find(const DoubleBoxes& boxes, Pair* out, std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return FinderAccess::run<DoubleBoxes>(*this, boxes, nullptr, &output, nullptr);
}
Result Finder::find(const DoubleBoxes& a, const DoubleBoxes& b, Pair* out,
                    std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return FinderAccess::run<DoubleBoxes>(*this, a, &b, &output, nullptr);
}
Result Finder::consume(const DoubleBoxes& boxes, Consumer consumer) {
  return FinderAccess::run<DoubleBoxes>(*this, boxes, nullptr, nullptr, &consumer);
}
Result Finder::consume(const DoubleBoxes& a, const DoubleBoxes& b, Consumer consumer) {
  return FinderAccess::run<DoubleBoxes>(*this, a, &b, nullptr, &consumer);
}

Explanation Finder::explain(const Boxes& boxes) {
  return FinderAccess::explain(*this, boxes, nullptr);
}
Explanation Finder::explain(const Boxes& a, const Boxes& b) {
  return FinderAccess::explain(*this, a, &b);
}

}  // namespace throng
