// API layer of the GPU Finder: checks arguments and calls the GPU backend, if it exists.
#include <throng/cuda.hpp>

#include <memory>
#include <new>
#include <utility>

#include "cuda/backend.hpp"
#include "device/failure.hpp"
#include "device/pipeline.hpp"
#include "update_boxes.hpp"
#include "validate.hpp"

namespace throng::cuda {

struct Finder::State {
  std::unique_ptr<Engine> engine;
};

// What the public calls share.
struct FinderAccess {
  // Calls f(engine, result) and writes the messages of its errors.
  template <class F>
  static Result run(Finder& finder, const F& f) noexcept {
    Result r;
    r.plan.backend = Backend::cuda;
    try {
      if (!finder.state_) finder.state_ = new (std::nothrow) Finder::State;
      if (!finder.state_) throw device::Failure{Status::out_of_memory, sizeof(Finder::State)};
      if (!finder.state_->engine) finder.state_->engine.reset(create(finder.memory_));
      f(*finder.state_->engine, r);
    } catch (const device::Failure& failure) {
      explain_failure(r, failure);
    }
    return r;
  }

  template <class F>
  static Result run(Finder& finder, const Boxes& a, const Boxes* b, const F& f) noexcept {
    Result r;
    if (!valid_on_device(a, b, finder.options_, r)) return r;
    r = run(finder, f);
    explain(r, b != nullptr,
            finder.state_ && finder.state_->engine && finder.state_->engine->nan_in_second_set(),
            "free some, or split the boxes");
    return r;
  }

  static Result find(Finder& finder, const Boxes& a, const Boxes* b, Pair* out,
                     std::size_t capacity, Stream stream) noexcept {
    return run(finder, a, b, [&](Engine& engine, Result& r) {
      engine.find_on_device(a, b, finder.options_, out, out ? capacity : 0, stream, r);
    });
  }
  static Result find_growing(Finder& finder, const Boxes& a, const Boxes* b,
                             Stream stream) noexcept {
    Pairs pairs;
    finder.pairs_ = {};
    const Result r = run(finder, a, b, [&](Engine& engine, Result& result) {
      pairs = engine.find_growing(a, b, finder.options_, stream, result);
    });
    if (r.ok()) finder.pairs_ = pairs;
    return r;
  }
  static Result find_async(Finder& finder, const Boxes& a, const Boxes* b, Pair* out,
                           std::size_t capacity, Report* report, Stream stream) noexcept {
    return run(finder, a, b, [&](Engine& engine, Result&) {
      engine.find_async(a, b, finder.options_, out, out ? capacity : 0, report, stream);
    });
  }
};

Result available() noexcept {
  Result r;
  r.plan.backend = Backend::cuda;
  try {
    check_available();
  } catch (const device::Failure& failure) {
    explain_failure(r, failure);
  }
  return r;
}

Finder::~Finder() { delete state_; }
Finder::Finder(Finder&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)),
      options_(other.options_),
      memory_(other.memory_),
      pairs_(std::exchange(other.pairs_, {})) {}
Finder& Finder::operator=(Finder&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  std::swap(memory_, other.memory_);
  std::swap(pairs_, other.pairs_);
  return *this;
}

Result Finder::reserve(std::size_t boxes, std::size_t pairs, Stream stream) noexcept {
  return FinderAccess::run(*this,
                           [&](Engine& engine, Result&) { engine.reserve(boxes, pairs, stream); });
}
Result Finder::find(const Boxes& boxes, Pair* out, std::size_t capacity, Stream stream) noexcept {
  return FinderAccess::find(*this, boxes, nullptr, out, capacity, stream);
}
Result Finder::find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity,
                    Stream stream) noexcept {
  return FinderAccess::find(*this, a, &b, out, capacity, stream);
}
Result Finder::find(const Boxes& boxes, Stream stream) noexcept {
  return FinderAccess::find_growing(*this, boxes, nullptr, stream);
}
Result Finder::find(const Boxes& a, const Boxes& b, Stream stream) noexcept {
  return FinderAccess::find_growing(*this, a, &b, stream);
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
  return state_ && state_->engine ? state_->engine->held() : 0;
}

namespace {

// Calls launch(job, result), which makes the boxes; shared by both forms.
template <class F>
Result update(const Bodies& bodies, Box* out, const UpdateOptions& options,
              std::size_t stride_bytes, const F& launch) noexcept {
  Result r;
  base::UpdateBoxes job;
  if (!make_job(bodies, out, options, stride_bytes, job, r)) return r;
  r.plan.backend = Backend::cuda;
  r.plan.reason = "one pass over the bodies";
  try {
    check_available();
    if (bodies.size() > max_box_count) throw device::Failure{Status::too_many_boxes, bodies.size()};
    launch(job, r);
    r.written = bodies.size();
  } catch (const device::Failure& failure) {
    explain_failure(r, failure);
  }
  return r;
}

}  // namespace

Result update_boxes(const Bodies& bodies, Box* out, BodyReport* report, Stream stream,
                    const UpdateOptions& options, std::size_t stride_bytes) noexcept {
  return update(bodies, out, options, stride_bytes, [&](const base::UpdateBoxes& job, Result& r) {
    const BodyReport result = update_boxes(job, bodies.size(), report, stream);
    if (result.bad_shapes == 0) return;
    r.status = Status::bad_shape;
    r.invalid_count = result.bad_shapes;
    r.first_invalid = result.first_bad_shape();
    explain(r, false, false, "");  // needs no memory advice
  });
}
Result update_boxes_async(const Bodies& bodies, Box* out, BodyReport* report, Stream stream,
                          const UpdateOptions& options, std::size_t stride_bytes) noexcept {
  return update(bodies, out, options, stride_bytes, [&](const base::UpdateBoxes& job, Result&) {
    update_boxes_async(job, bodies.size(), report, stream);
  });
}

}  // namespace throng::cuda
