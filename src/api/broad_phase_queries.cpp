// Public API of queries: overlaps of boxes, and ray and shape casts.
#include <algorithm>
#include <cstring>
#include <utility>

#include "broad_phase_state.hpp"

namespace throng {
namespace {

using Access = BroadPhaseAccess;
using capture::Operation;

// Hash of reported hits, stored in captures.
std::uint64_t hash_of(const SweepHitList& hits) noexcept {
  std::uint64_t sum = 0;
  for (const SweepHit& hit : hits) {
    std::uint64_t time;
    std::memcpy(&time, &hit.time, sizeof time);
    sum = capture::chain(sum, std::uint64_t{hit.sweep} << 32 | hit.object);
    sum = capture::chain(sum, time);
  }
  return sum;
}

// A stopped query may be incomplete; its results are discarded.
bool stopped(Result& r) noexcept {
  if (r.status != Status::stopped) return false;
  r.found = r.written = 0;
  return true;
}

Pairs view(const tracking::PodVector<Pair>& found) noexcept { return {found.data(), found.size()}; }
SweepHitList view(const tracking::PodVector<SweepHit>& found) noexcept {
  return {found.data(), found.size()};
}

bool valid_query(const Boxes& boxes, const Options& options, Result& r) noexcept {
  return valid(boxes, nullptr, options, r) && valid_floats(boxes, options, all_boxes, r);
}

Boxes boxes_of(const tracking::Sweeps& sweeps) noexcept {
  return base::boxes_of(sweeps.data, sweeps.count, sweeps.filters);
}

bool valid_query(const tracking::Sweeps& sweeps, const Options& options, Result& r) noexcept {
  if (!valid_sweeps(sweeps.data, sweeps.count, sweeps.which, r)) return false;
  if (!valid(boxes_of(sweeps), nullptr, options, r)) return false;
  for (std::size_t i = 0; i < sweeps.count; ++i) {
    if (!base::is_valid_sweep(sweeps.data[i]) && r.invalid_count++ == 0) r.first_invalid = i;
  }
  if (r.invalid_count == 0) {
    return options.inverted != InvertedPolicy::refuse ||
           check_not_inverted(boxes_of(sweeps), "", all_boxes, r);
  }
  explain_sweeps(r);
  return refuse(r, Status::nan_box);
}

// Shared by BroadPhase and BroadPhaseQuery. `tracker` null: there are no objects. `log`: null if
// the query is not captured.
void run_query(tracking::Queries& queries, tracking::Tracker* tracker, const Boxes& boxes,
               ObjectFilter filter, const Options& options, capture::Log* log, Result& r) {
  queries.overlaps().clear();
  if (!valid_query(boxes, options, r) || !tracker) return;
  if (filter) log = nullptr;  // a callback cannot be captured
  if (log) {
    log->begin(Operation::find_overlaps, 1);
    log->boxes(boxes);
  }
  tracker->find_overlaps(queries, boxes, options, r);
  if (stopped(r)) return queries.overlaps().clear();
  if (filter) {
    tracking::PodVector<Pair>& all = queries.overlaps();
    Pair* const end = std::remove_if(all.begin(), all.end(),
                                     [&](const Pair& pair) { return !filter(pair.second); });
    all.resize(static_cast<std::size_t>(end - all.begin()));
    r.found = r.written = all.size();
  }
  const Pairs found = view(queries.overlaps());
  if (log && *log) log->set_checksum(pair_checksum(found.data(), found.size()));
}

void run_query(tracking::Queries& queries, tracking::Tracker* tracker,
               const tracking::Sweeps& sweeps, const Options& options, capture::Log* log,
               Result& r) {
  queries.clear_hits();
  if (!valid_query(sweeps, options, r) || !tracker) return;
  if (sweeps.test.when) log = nullptr;  // a callback cannot be captured
  if (log) {
    log->begin(Operation::find_hits, 1, 0, static_cast<std::uint32_t>(sweeps.which));
    log->sweeps(sweeps.data, sweeps.count);
    log->boxes(boxes_of(sweeps));
  }
  tracker->find_hits(queries, sweeps, options, r);
  if (stopped(r)) return queries.clear_hits();
  if (log && *log) log->set_checksum(hash_of(view(queries.hits())));
}

}  // namespace

Result BroadPhase::find_overlaps(const Boxes& boxes, ObjectFilter filter) noexcept {
  const auto body = [&](tracking::Tracker& tracker, Result& r) {
    run_query(tracker.queries(), &tracker, boxes, filter, options_, &Access::log(*this), r);
  };
  return Access::call(*this, body, Access::query_memory_hint);
}
Pairs BroadPhase::overlaps() const noexcept {
  return state_ ? view(state_->tracker.queries().overlaps()) : Pairs{};
}

Result BroadPhase::find_hits(const Sweep* sweeps, std::size_t count, SweepHits which,
                             const Filters& filters, const SweepTest& test) noexcept {
  const tracking::Sweeps request{sweeps, count, which, filters, test};
  const auto body = [&](tracking::Tracker& tracker, Result& r) {
    run_query(tracker.queries(), &tracker, request, options_, &Access::log(*this), r);
  };
  return Access::call(*this, body, Access::query_memory_hint);
}
SweepHitList BroadPhase::hits() const noexcept {
  return state_ ? view(state_->tracker.queries().hits()) : SweepHitList{};
}

BroadPhaseQuery::~BroadPhaseQuery() { Access::destroy(*this); }
BroadPhaseQuery::BroadPhaseQuery(BroadPhaseQuery&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)), options_(other.options_) {}
BroadPhaseQuery& BroadPhaseQuery::operator=(BroadPhaseQuery&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  return *this;
}

Result BroadPhaseQuery::find_overlaps(const BroadPhase& objects, const Boxes& boxes,
                                      ObjectFilter filter) noexcept {
  return Access::run_query(*this, objects,
                           [&](tracking::Queries& queries, tracking::Tracker* it, Result& r) {
                             run_query(queries, it, boxes, filter, options_, nullptr, r);
                           });
}
Pairs BroadPhaseQuery::overlaps() const noexcept {
  return state_ ? view(state_->queries.overlaps()) : Pairs{};
}

Result BroadPhaseQuery::find_hits(const BroadPhase& objects, const Sweep* sweeps, std::size_t count,
                                  SweepHits which, const Filters& filters,
                                  const SweepTest& test) noexcept {
  const tracking::Sweeps request{sweeps, count, which, filters, test};
  return Access::run_query(*this, objects,
                           [&](tracking::Queries& queries, tracking::Tracker* it, Result& r) {
                             run_query(queries, it, request, options_, nullptr, r);
                           });
}
SweepHitList BroadPhaseQuery::hits() const noexcept {
  return state_ ? view(state_->queries.hits()) : SweepHitList{};
}
std::size_t BroadPhaseQuery::memory_bytes() const noexcept {
  return state_ ? state_->engine.memory().held() : 0;
}

}  // namespace throng
