// Few changed: around each of them is searched, and what is found compared with the pairs it had.
#include <algorithm>
#include <atomic>
#include <utility>

#include "core/profile.hpp"
#include "live/tracker.hpp"

namespace throng::live {
namespace {

// Where searches compare twice as many boxes as in new cells, and more than this, so much is lost.
constexpr double fair_comparisons = 64;
// How many searches it takes to forget half of what those before them showed.
constexpr double memory_of_searches = 256;
// Memory is asked for so many objects ahead. Of 4, 8, 16: no difference between the latter two.
constexpr std::size_t ahead = 8;
// So many hits of a search are compared with each pair the object has; more are marked.
constexpr std::uint32_t few_hits = 16;

}  // namespace

// Of two objects that both changed, the one with the lower id tells of their pair.
void Tracker::search_around(const Options& options, Result& r) {
  THRONG_RANGE("search around");
  pairs_.next_begun().clear();
  pairs_.next_ended().clear();
  const List<ObjectId>& dirty = objects_.dirty_list();
  std::uint64_t compared = 0;
  Cells::Reach reaches[ahead];
  PairSet::Walk walks[ahead];
  const auto reach_ahead = [&](std::size_t i) {
    if (i >= dirty.size()) return;
    const Body& body = objects_.body(dirty[i]);
    pairs_.start(walks[i % ahead], objects_, dirty[i]);
    if (body.home == none) return;
    Box room;
    cells_.reach(objects_.grown(dirty[i], room), worlds_of(dirty[i]), reaches[i % ahead]);
  };
  for (std::size_t i = 0; i < ahead; ++i) reach_ahead(i);
  ObjectId hits[Cells::most_hits];
  for (std::size_t i = 0; i < dirty.size(); ++i) {
    if (options.stop && options.stop->load(std::memory_order_relaxed)) {
      r.status = Status::stopped;
      return;
    }
    if (const std::size_t soon = i + ahead / 2; soon < dirty.size()) {
      if (objects_.body(dirty[soon]).home != none) cells_.prefetch_chains(reaches[soon % ahead]);
    }
    for (std::size_t soon = i + 1; soon < std::min(i + ahead, dirty.size()); ++soon)
      pairs_.step(walks[soon % ahead]);
    const ObjectId id = dirty[i];
    std::uint32_t count = 0;
    Box room;
    if (objects_.body(id).home != none)
      count = cells_.search_few(objects_.grown(id, room), id, reaches[i % ahead], hits, compared);
    if (count <= few_hits)
      tell_few(walks[i % ahead], hits, count);
    else
      compared += tell_many(walks[i % ahead], hits, count);
    reach_ahead(i + ahead);
  }
  pairs_.commit_linked(objects_);
  r.comparisons = compared;
  const auto searches = static_cast<double>(dirty.size());
  comparisons_ += (static_cast<double>(compared) / searches - comparisons_) * searches /
                  (searches + memory_of_searches);
  const double fair = std::max(fair_comparisons, 2 * usual_comparisons_) * searches;
  if (usual_comparisons_ == 0) {
    usual_comparisons_ = static_cast<double>(compared) / searches + 1;
  } else {
    regret_ += comparison_ns * std::max(0.0, static_cast<double>(compared) - fair);
  }
}

bool Tracker::tells(ObjectId id, ObjectId other) const noexcept {
  return id < other || !objects_.is_dirty(other);
}
void Tracker::tell_begun(ObjectId id, ObjectId other) {
  if (!tells(id, other)) return;
  cpu::prefetch(&objects_.body(other));
  pairs_.next_begun().append({std::min(id, other), std::max(id, other), none});
}
void Tracker::tell_ended(ObjectId id, ObjectId other, std::uint32_t slot) {
  if (!tells(id, other)) return;
  cpu::prefetch(&objects_.body(other));
  pairs_.next_ended().append({std::min(id, other), std::max(id, other), slot});
}

// Takes those that the object already had from the hits; what is left has begun.
void Tracker::tell_few(const PairSet::Walk& had, ObjectId* hits, std::uint32_t count) {
  const ObjectId id = had.id;
  if (objects_.has_filters()) {
    const std::uint32_t all = std::exchange(count, 0);
    for (std::uint32_t k = 0; k < all; ++k) {
      hits[count] = hits[k];
      count += objects_.may_pair(id, hits[k]);
    }
  }
  const auto take = [&](ObjectId other, std::uint32_t from) {  // wherever it is: it may be twice
    const std::uint32_t all = std::exchange(count, from);
    for (std::uint32_t k = from; k < all; ++k) {
      hits[count] = hits[k];
      count += hits[k] != other;
    }
    return count != all;
  };
  pairs_.each_pair(had, [&](ObjectId other, std::uint32_t slot) {
    if (!take(other, 0)) tell_ended(id, other, slot);
  });
  for (std::uint32_t k = 0; k < count; ++k) {
    tell_begun(id, hits[k]);
    take(hits[k], k + 1);
  }
}

// The same by marks; above most_hits they are yet to be found. Returns how many boxes that
// compared.
std::uint64_t Tracker::tell_many(const PairSet::Walk& had, const ObjectId* hits,
                                 std::uint32_t count) {
  const ObjectId id = had.id;
  const std::uint32_t before = objects_.next_tokens(2), now = before + 1;
  pairs_.each_pair(had, [&](ObjectId other, std::uint32_t) { objects_.mark(other) = before; });
  objects_.mark(id) = now;
  const auto see = [&](ObjectId other) {
    std::uint32_t& mark = objects_.mark(other);
    if (mark == now || !objects_.may_pair(id, other)) return;
    if (mark != before) tell_begun(id, other);
    mark = now;
  };
  std::uint64_t compared = 0;
  if (count <= Cells::most_hits)
    std::for_each(hits, hits + count, see);
  else
    compared = cells_.search_many(objects_.grown(id), worlds_of(id), see);
  pairs_.each_pair(had, [&](ObjectId other, std::uint32_t slot) {
    if (objects_.mark(other) == before) tell_ended(id, other, slot);
  });
  return compared;
}

}  // namespace throng::live
