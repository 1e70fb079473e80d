#include "tracking/local_update.hpp"

#include <algorithm>
#include <utility>

namespace throng::tracking {
namespace {

// Prefetch distances in objects: for cells, for the first edge (twice that) and for the body (four
// times that). Of 6, 8, 12 and 16 for cells, 8 is fastest, with cold caches, too.
constexpr std::size_t ahead = 8, edges_ahead = 2 * ahead, bodies_ahead = 2 * edges_ahead;
// Objects between two checks of the budget.
constexpr std::size_t budget_step = 16;
// Up to this many hits are compared with each previous pair; more are marked in a bit set.
constexpr std::uint32_t few_hits = 8;

bool is_reporter(const Objects& objects, ObjectId id, ObjectId other) noexcept {
  return id < other || !objects.is_dirty(other);
}

}  // namespace

void LocalUpdate::start() noexcept {
  begun_.clear();
  ended_.clear();
  work_ = {};
  searched_ = 0;
  if (std::exchange(seen_not_clear_, false)) std::fill(seen_.begin(), seen_.end(), 0);
}

void LocalUpdate::match(const LocalUpdate& other) {
  begun_.match(other.begun_);
  ended_.match(other.ended_);
  hits_.match(other.hits_);
  seen_.match(other.seen_);
}

void LocalUpdate::search(const Scene& scene, const ObjectId* ids, std::size_t count,
                         std::uint64_t max_work, base::Cancellation& stop) {
  if (work_.total() > max_work) return;
  const Objects& objects = scene.objects;
  Cells::CandidateBuckets candidate_lists[ahead];
  PairSet::EdgeCursor cursors[edges_ahead];
  const auto list_ahead = [&](std::size_t i) {
    if (i >= count) return;
    const ObjectId id = ids[i];
    if (scene.forest || objects.body(id).bucket == none) return;
    Box storage;
    scene.cells.candidates(objects.expanded(id, storage), worlds_of(objects, objects.filter(id)),
                           candidate_lists[i % ahead]);
  };
  const auto start_ahead = [&](std::size_t i) {
    if (i < count) scene.pairs.start(cursors[i % edges_ahead], objects, ids[i]);
  };
  for (std::size_t i = 0; i < edges_ahead; ++i) start_ahead(i);
  for (std::size_t i = 0; i < ahead; ++i) list_ahead(i);
  // A few more edges per object than the average.
  const std::size_t steps = std::min<std::uint64_t>(
      edges_ahead - 1, 3 + 3 * std::uint64_t{scene.pairs.count()} / (objects.count() + 1));
  ObjectId hits[Cells::max_hits + 1];
  std::size_t i = 0;
  for (; i < count; ++i) {
    if (i % budget_step == 0 && work_.total() > max_work) break;
    if (stop()) break;
    if (const std::size_t soon = i + ahead / 2; soon < count) {
      if (!scene.forest && objects.body(ids[soon]).bucket != none)
        scene.cells.prefetch_chains(candidate_lists[soon % ahead]);
    }
    for (std::size_t soon = i + 1; soon < std::min(i + 1 + steps, count); ++soon)
      scene.pairs.step(cursors[soon % edges_ahead]);
    const ObjectId id = ids[i];
    std::uint32_t found = 0;
    Box storage;
    if (objects.body(id).bucket != none) {
      found = scene.forest ? search_forest(scene, id, hits)
                           : scene.cells.search_few(objects.expanded(id, storage), id,
                                                    candidate_lists[i % ahead], hits, work_);
    }
    if (found <= few_hits)
      report_few(scene, cursors[i % edges_ahead], hits, found);
    else
      report_many(scene, cursors[i % edges_ahead], hits, found);
    list_ahead(i + ahead);
    start_ahead(i + edges_ahead);
    if (i + bodies_ahead < count) objects.prefetch(ids[i + bodies_ahead]);
  }
  searched_ += i;
}

// Objects that overlap this one, itself excluded; result as of Cells::search_few().
std::uint32_t LocalUpdate::search_forest(const Scene& scene, ObjectId id, ObjectId* hits) {
  std::uint32_t count = 0;
  scene.forest->search(scene.objects.expanded(id), scene.objects.filter(id), work_,
                       [&](ObjectId other) {
                         if (other == id || count > Cells::max_hits) return;
                         if (count < Cells::max_hits) hits[count] = other;
                         ++count;
                       });
  return count;
}

void LocalUpdate::report_begun(const Scene& scene, ObjectId id, ObjectId other) {
  if (!is_reporter(scene.objects, id, other)) return;
  base::prefetch(&scene.objects.body(other));
  begun_.append({std::min(id, other), std::max(id, other), none});
}
void LocalUpdate::report_ended(const Scene& scene, ObjectId id, ObjectId other,
                               std::uint32_t slot) {
  if (!is_reporter(scene.objects, id, other)) return;
  base::prefetch(&scene.objects.body(other));
  ended_.append({std::min(id, other), std::max(id, other), slot});
}

// Removes the previous pairs from the hits; the remaining hits have begun.
void LocalUpdate::report_few(const Scene& scene, const PairSet::EdgeCursor& previous,
                             ObjectId* hits, std::uint32_t count) {
  const ObjectId id = previous.id;
  if (scene.objects.has_filters()) {
    const std::uint32_t all = std::exchange(count, 0);
    for (std::uint32_t k = 0; k < all; ++k) {
      hits[count] = hits[k];
      count += scene.objects.may_pair(id, hits[k]);
    }
  }
  // all occurrences: a search may report a hit twice
  const auto take = [&](ObjectId other, std::uint32_t from) {
    const std::uint32_t all = std::exchange(count, from);
    for (std::uint32_t k = from; k < all; ++k) {
      hits[count] = hits[k];
      count += hits[k] != other;
    }
    return count != all;
  };
  scene.pairs.each_pair(previous, [&](ObjectId other, std::uint32_t slot) {
    if (!take(other, 0)) report_ended(scene, id, other, slot);
  });
  for (std::uint32_t k = 0; k < count; ++k) {
    report_begun(scene, id, hits[k]);
    take(hits[k], k + 1);
  }
}

// The same with a bit per object. If count > max_hits, the hits are searched for here.
void LocalUpdate::report_many(const Scene& scene, const PairSet::EdgeCursor& previous,
                              const ObjectId* hits, std::uint32_t count) {
  const Objects& objects = scene.objects;
  const ObjectId id = previous.id;
  const std::size_t words = objects.limit() / 64 + 1;
  if (const std::size_t before = seen_.size(); before < words) {
    seen_.reserve(words);
    seen_.resize(words);
    std::fill(seen_.begin() + before, seen_.end(), 0);
  }
  hits_.clear();
  seen_not_clear_ = true;
  const auto mark_seen =
      [&](ObjectId other) {  // may include the object itself, which is not reported
        if (is_seen(other) || !objects.may_pair(id, other)) return;
        hits_.append(other);
        flip(other);
      };
  if (count <= Cells::max_hits) {
    std::for_each(hits, hits + count, mark_seen);
  } else if (scene.forest) {
    scene.forest->search(objects.expanded(id), objects.filter(id), work_, mark_seen);
  } else {
    scene.cells.search_many(objects.expanded(id), worlds_of(objects, objects.filter(id)), work_,
                            mark_seen);
  }
  scene.pairs.each_pair(previous, [&](ObjectId other, std::uint32_t slot) {
    if (is_seen(other))
      flip(other);
    else
      report_ended(scene, id, other, slot);
  });
  for (const ObjectId other : hits_) {
    if (!is_seen(other)) continue;
    flip(other);
    report_begun(scene, id, other);
  }
  seen_not_clear_ = false;
}

}  // namespace throng::tracking
