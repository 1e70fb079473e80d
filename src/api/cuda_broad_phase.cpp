// API layer of persistent objects on a GPU: checks arguments and calls the backend, if it exists.
#include <throng/cuda_broad_phase.hpp>

#include <cmath>
#include <memory>
#include <new>
#include <utility>

#include "cuda/backend.hpp"
#include "device/failure.hpp"
#include "device/queries.hpp"
#include "validate.hpp"

namespace throng::cuda {

using ull = unsigned long long;

struct BroadPhase::State {
  std::unique_ptr<Scene> scene;
};

struct BroadPhaseAccess {
  // Calls f(scene, result) and writes the messages of its errors.
  template <class F>
  static Result run(BroadPhase& it, const F& f) noexcept {
    Result r;
    r.plan.backend = Backend::cuda;
    if (!valid_on_device({}, nullptr, it.options_, r)) return r;
    if (!(it.fat_margin_ >= 0) || !std::isfinite(it.fat_margin_)) {
      set_message(r, "the margin of fat boxes is %g; it must be finite and not negative",
                  static_cast<double>(it.fat_margin_));
      r.status = Status::bad_option;
      return r;
    }
    try {
      if (!it.state_) it.state_ = new (std::nothrow) BroadPhase::State;
      if (!it.state_) throw device::Failure{Status::out_of_memory, sizeof(BroadPhase::State)};
      if (!it.state_->scene)
        it.state_->scene.reset(create_scene(it.fat_margin_, it.options_, it.memory_));
      f(*it.state_->scene, r);
    } catch (const device::Failure& failure) {
      explain_failure(r, failure, "free some, or keep fewer objects");
    }
    if (!r.ok()) explain(r, false, false, "free some, or keep fewer objects");
    return r;
  }
  // The same with boxes, whose filters are checked where they are used.
  template <class F>
  static Result run(BroadPhase& it, Boxes boxes, bool with_filters, const F& f) noexcept {
    if (!with_filters) boxes.filters = {};
    Result r;
    if (!valid_on_device(boxes, nullptr, it.options_, r)) return r;
    return run(it, [&](Scene& scene, Result& result) { f(scene, boxes, result); });
  }
  // The same with sweeps and their filters.
  template <class F>
  static Result run_sweeps(BroadPhase& it, const Sweep* sweeps, std::size_t count, SweepHits which,
                           const Filters& filters, const F& f) noexcept {
    Result r;
    if (!valid_sweeps(sweeps, count, which, r)) return r;
    const auto queries = device::QueryBatch::of_sweeps(sweeps, count, filters);
    return run(it, queries.boxes, true, [&](Scene& scene, const Boxes&, Result& result) {
      f(scene, queries, result);
      if (result.status == Status::nan_box) explain_sweeps(result);
    });
  }
  static const Scene* scene(const BroadPhase& it) noexcept {
    return it.state_ ? it.state_->scene.get() : nullptr;
  }
  // Whether there is a box for every id; otherwise false, with the message.
  static bool has_box_per_id(const Scene& scene, const Boxes& boxes, Result& r) noexcept {
    if (boxes.size() == scene.id_limit()) return true;
    set_message(r, "%llu boxes were given; give one for every id below id_limit(), which is %llu",
                ull{boxes.size()}, ull{scene.id_limit()});
    return refuse(r, Status::bad_boxes);
  }
};
using Access = BroadPhaseAccess;

BroadPhase::~BroadPhase() { delete state_; }
BroadPhase::BroadPhase(BroadPhase&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)),
      fat_margin_(other.fat_margin_),
      options_(other.options_),
      memory_(other.memory_) {}
BroadPhase& BroadPhase::operator=(BroadPhase&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(fat_margin_, other.fat_margin_);
  std::swap(options_, other.options_);
  std::swap(memory_, other.memory_);
  return *this;
}

Result BroadPhase::copy_from(const BroadPhase& other, Stream stream) noexcept {
  if (this == &other) return {};
  return Access::run(*this, [&](Scene& mine, Result& r) {
    std::unique_ptr<Scene> none;
    const Scene* theirs = Access::scene(other);
    if (!theirs) {  // no call has been made on it
      none.reset(create_scene(other.fat_margin_, other.options_, {}));
      theirs = none.get();
    }
    mine.copy(*theirs, stream);
    fat_margin_ = other.fat_margin_;
    options_.margin = other.options_.margin;
    r.found = mine.object_count();
  });
}

Result BroadPhase::add(const Boxes& boxes, ObjectId* ids, Stream stream) noexcept {
  return Access::run(*this, boxes, true, [&](Scene& scene, const Boxes& given, Result& r) {
    scene.add(given, ids, stream, r);
  });
}
Result BroadPhase::remove(const ObjectId* ids, std::size_t count, Stream stream) noexcept {
  return Access::run(*this, [&](Scene& scene, Result& r) { scene.remove(ids, count, stream, r); });
}
Result BroadPhase::move(const ObjectId* ids, const Boxes& boxes, Stream stream) noexcept {
  return Access::run(*this, boxes, false, [&](Scene& scene, const Boxes& given, Result& r) {
    scene.move(ids, given, stream, r);
  });
}
Result BroadPhase::move_all(const Boxes& boxes, Stream stream) noexcept {
  return Access::run(*this, boxes, false, [&](Scene& scene, const Boxes& given, Result& r) {
    if (Access::has_box_per_id(scene, given, r)) scene.move_all(given, stream, r);
  });
}
Result BroadPhase::set_filters(const ObjectId* ids, std::size_t count, const Filters& filters,
                               Stream stream) noexcept {
  constexpr Box some{};
  Boxes stand_in(&some, count, 0);  // only the filters are read
  stand_in.filters = filters;
  return Access::run(*this, stand_in, true, [&](Scene& scene, const Boxes& given, Result& r) {
    scene.set_filters(ids, given.size(), given.filters, stream, r);
  });
}
Result BroadPhase::shift_origin(const Vec3& by, Stream stream) noexcept {
  return Access::run(*this, [&](Scene& scene, Result& r) {
    if (std::isfinite(by.x) && std::isfinite(by.y) && std::isfinite(by.z))
      return scene.shift_origin(by, stream, r);
    set_message(r, "the shift of origin (%g, %g, %g) is not finite", static_cast<double>(by.x),
                static_cast<double>(by.y), static_cast<double>(by.z));
    r.status = Status::bad_option;
  });
}

Result BroadPhase::update(Stream stream) noexcept {
  return Access::run(*this, [&](Scene& scene, Result& r) { scene.update(nullptr, stream, r); });
}
Result BroadPhase::update(const Boxes& boxes, Stream stream) noexcept {
  return Access::run(*this, boxes, false, [&](Scene& scene, const Boxes& given, Result& r) {
    if (Access::has_box_per_id(scene, given, r)) scene.update(&given, stream, r);
  });
}

LivePairs BroadPhase::begun() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->begun() : LivePairs{};
}
LivePairs BroadPhase::ended() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->ended() : LivePairs{};
}
LivePairs BroadPhase::candidates() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->candidates() : LivePairs{};
}
Result BroadPhase::pairs(LivePairs& out, Stream stream) noexcept {
  out = {};
  return Access::run(*this, [&](Scene& scene, Result& r) {
    out = scene.gather_pairs(stream);
    r.found = out.size();
  });
}

Result BroadPhase::find_overlaps(const Boxes& boxes, Stream stream) noexcept {
  return Access::run(*this, boxes, true, [&](Scene& scene, const Boxes& given, Result& r) {
    scene.find_overlaps(given, stream, r);
  });
}
Result BroadPhase::find_hits(const Sweep* sweeps, std::size_t count, SweepHits which,
                             const Filters& filters, Stream stream) noexcept {
  return Access::run_sweeps(*this, sweeps, count, which, filters,
                            [&](Scene& scene, const device::QueryBatch& queries, Result& r) {
                              scene.find_hits(queries, which, stream, r);
                            });
}
Result BroadPhase::find_first_hits(const Sweep* sweeps, std::size_t count, const Filters& filters,
                                   SweepHit* out, Stream stream) noexcept {
  return Access::run_sweeps(*this, sweeps, count, SweepHits::first, filters,
                            [&](Scene& scene, const device::QueryBatch& queries, Result& r) {
                              scene.find_first_hits(queries, out, stream, r);
                            });
}
Pairs BroadPhase::overlaps() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->overlaps() : Pairs{};
}
SweepHitList BroadPhase::hits() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->hits() : SweepHitList{};
}

std::uint64_t BroadPhase::object_count() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->object_count() : 0;
}
std::uint64_t BroadPhase::pair_count() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->pair_count() : 0;
}
std::uint64_t BroadPhase::id_limit() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->id_limit() : 0;
}
std::uint64_t BroadPhase::slot_limit() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->slot_limit() : 0;
}
std::size_t BroadPhase::memory_bytes() const noexcept {
  const Scene* scene = Access::scene(*this);
  return scene ? scene->held() : 0;
}

}  // namespace throng::cuda
