// Questions to objects that live: what overlaps boxes, and what moving boxes hit.
#include <cmath>
#include <cstring>

#include "broad_phase_state.hpp"

namespace throng {
namespace {

using Access = BroadPhaseAccess;
using capture::Operation;

// What a capture keeps of what was told.
std::uint64_t fold_of(const SweepHitList& hits) noexcept {
  std::uint64_t sum = 0;
  for (const SweepHit& hit : hits) {
    std::uint64_t time;
    std::memcpy(&time, &hit.time, sizeof time);
    sum = capture::chain(sum, std::uint64_t{hit.sweep} << 32 | hit.object);
    sum = capture::chain(sum, time);
  }
  return sum;
}

// Of a question, which then may have left out some of what it was asked.
bool stopped(Result& r) noexcept {
  if (r.status != Status::stopped) return false;
  r.found = r.written = 0;
  return true;
}

}  // namespace

Result BroadPhase::find_overlaps(const Boxes& boxes) noexcept {
  return Access::call(*this, [&](live::Tracker& tracker, Result& r) {
    tracker.queries().overlaps().clear();
    if (!valid(boxes, nullptr, options_, r)) return;
    if (!valid_floats(boxes, boxes.size(), options_, all_boxes, r)) return;
    capture::Log& log = Access::log(*this);
    log.begin(Operation::find_overlaps, 1);
    log.boxes(boxes);
    tracker.find_overlaps(boxes, options_, r);
    if (stopped(r))
      tracker.queries().overlaps().clear();
    else if (log)
      log.told(pair_checksum(overlaps().data(), overlaps().size()));
  });
}
Pairs BroadPhase::overlaps() const noexcept {
  if (!state_) return {};
  const live::List<Pair>& found = state_->tracker.queries().overlaps();
  return {found.data(), found.size()};
}

Result BroadPhase::find_hits(const Sweep* sweeps, std::size_t count, SweepHits which,
                             const Filters& filters) noexcept {
  return Access::call(*this, [&](live::Tracker& tracker, Result& r) {
    tracker.queries().forget_hits();
    if (which > SweepHits::first) {
      say(r, "SweepHits is %d, which is none of its constants; use one", static_cast<int>(which));
      r.status = Status::bad_option;
      return;
    }
    if (!sweeps && count != 0) {
      say(r, "the array of sweeps is null; give its address, with %llu sweeps", ull{count});
      r.status = Status::bad_boxes;
      return;
    }
    Boxes boxes(sweeps ? &sweeps->box : nullptr, count, sizeof(Sweep));
    boxes.filters = filters;
    if (!valid(boxes, nullptr, options_, r)) return;
    for (std::size_t i = 0; sweeps && i < count; ++i) {
      const Vec3& by = sweeps[i].by;
      const bool good = std::isfinite(by.x) && std::isfinite(by.y) && std::isfinite(by.z) &&
                        !core::has_nan(sweeps[i].box);
      if (!good && r.invalid_count++ == 0) r.first_invalid = i;
    }
    if (r.invalid_count != 0) {
      say(r, "%llu sweeps have a NaN or go infinitely far, the first is sweep %llu; mend them",
          ull{r.invalid_count}, ull{r.first_invalid});
      r.status = Status::nan_box;
      return;
    }
    capture::Log& log = Access::log(*this);
    log.begin(Operation::find_hits, 1, 0, static_cast<std::uint32_t>(which));
    log.sweeps(sweeps, count);
    log.boxes(boxes);
    tracker.find_hits(sweeps, count, which, filters, options_, r);
    if (stopped(r))
      tracker.queries().forget_hits();
    else if (log)
      log.told(fold_of(hits()));
  });
}
SweepHitList BroadPhase::hits() const noexcept {
  if (!state_) return {};
  const live::List<SweepHit>& found = state_->tracker.queries().hits();
  return {found.data(), found.size()};
}

}  // namespace throng
