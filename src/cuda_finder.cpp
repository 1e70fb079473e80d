// The hall of the GPU's door: what is asked is checked, and answered by the GPU backend if there is
// one.
#include <throng/cuda.hpp>

#include <new>
#include <utility>

#include "pipeline/failure.hpp"
#include "pipeline/pipeline.hpp"
#include "validate.hpp"
#if defined(THRONG_CUDA)
#include "cuda/backend.hpp"
#endif

namespace throng::cuda {

#if defined(THRONG_CUDA)
struct Finder::State {
  ~State() { delete engine; }
  Engine* engine = nullptr;
};

// What the public calls have in common.
struct FinderAccess {
  // f(engine, result) with the words for what goes wrong there.
  template <class F>
  static Result run(Finder& finder, const F& f) noexcept {
    Result r;
    r.plan.backend = Backend::cuda;
    try {
      if (!finder.state_) finder.state_ = new (std::nothrow) Finder::State;
      if (!finder.state_) throw pipeline::Failure{Status::out_of_memory, sizeof(Finder::State)};
      if (!finder.state_->engine) finder.state_->engine = create(finder.memory_);
      f(*finder.state_->engine, r);
    } catch (const pipeline::Failure& failure) {
      explain_failure(r, failure.status, failure.bytes, failure.text);
    }
    return r;
  }

  template <class F>
  static Result run(Finder& finder, const Boxes& a, const Boxes* b, const F& f) noexcept {
    Result r;
    if (!valid_on_device(a, b, finder.options_, r)) return r;
    r = run(finder, f);
    explain(r, b != nullptr,
            finder.state_ && finder.state_->engine && finder.state_->engine->nan_in_second_set());
    return r;
  }

  static Result find(Finder& finder, const Boxes& a, const Boxes* b, Pair* out,
                     std::size_t capacity, Stream stream) noexcept {
    return run(finder, a, b, [&](Engine& engine, Result& r) {
      engine.find_on_device(a, b, finder.options_, out, out ? capacity : 0, stream, r);
    });
  }
  static Result find_async(Finder& finder, const Boxes& a, const Boxes* b, Pair* out,
                           std::size_t capacity, Report* report, Stream stream) noexcept {
    return run(finder, a, b, [&](Engine& engine, Result&) {
      engine.find_async(a, b, finder.options_, out, out ? capacity : 0, report, stream);
    });
  }
};
#else
struct Finder::State {};

struct FinderAccess {
  static Result none() noexcept {
    Result r;
    explain_failure(r, Status::no_device, 0, nullptr);
    return r;
  }
  static Result find(Finder&, const Boxes&, const Boxes*, Pair*, std::size_t, Stream) noexcept {
    return none();
  }
  static Result find_async(Finder&, const Boxes&, const Boxes*, Pair*, std::size_t, Report*,
                           Stream) noexcept {
    return none();
  }
};
#endif

Result available() noexcept {
#if defined(THRONG_CUDA)
  Result r;
  r.plan.backend = Backend::cuda;
  try {
    check_available();
  } catch (const pipeline::Failure& failure) {
    explain_failure(r, failure.status, failure.bytes, failure.text);
  }
  return r;
#else
  return FinderAccess::none();
#endif
}

Finder::~Finder() { delete state_; }
Finder::Finder(Finder&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)),
      options_(other.options_),
      memory_(other.memory_) {}
Finder& Finder::operator=(Finder&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  std::swap(memory_, other.memory_);
  return *this;
}

Result Finder::reserve([[maybe_unused]] std::size_t boxes, [[maybe_unused]] std::size_t pairs,
                       [[maybe_unused]] Stream stream) noexcept {
#if defined(THRONG_CUDA)
  return FinderAccess::run(*this,
                           [&](Engine& engine, Result&) { engine.reserve(boxes, pairs, stream); });
#else
  return FinderAccess::none();
#endif
}
Result Finder::find(const Boxes& boxes, Pair* out, std::size_t capacity, Stream stream) noexcept {
  return FinderAccess::find(*this, boxes, nullptr, out, capacity, stream);
}
Result Finder::find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity,
                    Stream stream) noexcept {
  return FinderAccess::find(*this, a, &b, out, capacity, stream);
}
Result Finder::find_async(const Boxes& boxes, Pair* out, std::size_t capacity, Report* report,
                          Stream stream) noexcept {
  return FinderAccess::find_async(*this, boxes, nullptr, out, capacity, report, stream);
}
Result Finder::find_async(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity,
                          Report* report, Stream stream) noexcept {
  return FinderAccess::find_async(*this, a, &b, out, capacity, report, stream);
}
std::size_t Finder::memory_bytes() const noexcept {
#if defined(THRONG_CUDA)
  return state_ && state_->engine ? state_->engine->held() : 0;
#else
  return 0;
#endif
}

Result update_boxes(const Bodies& bodies, Box* out, [[maybe_unused]] BodyReport* report,
                    [[maybe_unused]] Stream stream, const UpdateOptions& options,
                    std::size_t stride_bytes) noexcept {
  Result r;
  core::UpdateBoxes job;
  if (!make_job(bodies, out, options, stride_bytes, job, r)) return r;
  r.plan.backend = Backend::cuda;
  r.plan.reason = "one pass over the bodies";
#if defined(THRONG_CUDA)
  try {
    check_available();
    if (bodies.size() > max_box_count)
      throw pipeline::Failure{Status::too_many_boxes, bodies.size()};
    update_boxes(job, bodies.size(), report, stream);
    r.written = bodies.size();
  } catch (const pipeline::Failure& failure) {
    explain_failure(r, failure.status, failure.bytes, failure.text);
  }
  return r;
#else
  return FinderAccess::none();
#endif
}

}  // namespace throng::cuda
