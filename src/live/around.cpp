#include "live/around.hpp"

#include <algorithm>
#include <utility>

namespace throng::live {
namespace {

// Prefetch distances in objects: for cells, for the first edge (twice that) and for the body (four
// times that). Of 6, 8, 12 and 16 for cells, 8 is fastest, with cold caches, too.
constexpr std::size_t ahead = 8, edges_ahead = 2 * ahead, bodies_ahead = 2 * edges_ahead;
// Objects between two checks of the budget.
constexpr std::size_t budget_step = 16;
// Up to this many hits are compared with each previous pair; more are marked in a bit set.
constexpr std::uint32_t few_hits = 8;

bool tells(const Objects& objects, ObjectId id, ObjectId other) noexcept {
  return id < other || !objects.is_dirty(other);
}

}  // namespace

void Around::start() noexcept {
  begun_.clear();
  ended_.clear();
  work_ = {};
  searched_ = 0;
  if (std::exchange(unclean_, false)) std::fill(seen_.begin(), seen_.end(), 0);
}

void Around::match(const Around& other) {
  begun_.match(other.begun_);
  ended_.match(other.ended_);
  hits_.match(other.hits_);
  seen_.match(other.seen_);
}

void Around::search(const Scene& scene, const ObjectId* ids, std::size_t count,
                    std::uint64_t most_work, cpu::Stop& stop) {
  if (work_.total() > most_work) return;
  const Objects& objects = scene.objects;
  Cells::Reach reaches[ahead];
  PairSet::Walk walks[edges_ahead];
  const auto reach_ahead = [&](std::size_t i) {
    if (i >= count) return;
    const ObjectId id = ids[i];
    if (scene.forest || objects.body(id).home == none) return;
    Box room;
    scene.cells.reach(objects.grown(id, room), worlds_of(objects, objects.filter(id)),
                      reaches[i % ahead]);
  };
  const auto walk_ahead = [&](std::size_t i) {
    if (i < count) scene.pairs.start(walks[i % edges_ahead], objects, ids[i]);
  };
  for (std::size_t i = 0; i < edges_ahead; ++i) walk_ahead(i);
  for (std::size_t i = 0; i < ahead; ++i) reach_ahead(i);
  // A few more edges per object than the average.
  const std::size_t steps = std::min<std::uint64_t>(
      edges_ahead - 1, 3 + 3 * std::uint64_t{scene.pairs.count()} / (objects.count() + 1));
  ObjectId hits[Cells::most_hits + 1];
  std::size_t i = 0;
  for (; i < count; ++i) {
    if (i % budget_step == 0 && work_.total() > most_work) break;
    if (stop()) break;
    if (const std::size_t soon = i + ahead / 2; soon < count) {
      if (!scene.forest && objects.body(ids[soon]).home != none)
        scene.cells.prefetch_chains(reaches[soon % ahead]);
    }
    for (std::size_t soon = i + 1; soon < std::min(i + 1 + steps, count); ++soon)
      scene.pairs.step(walks[soon % edges_ahead]);
    const ObjectId id = ids[i];
    std::uint32_t found = 0;
    Box room;
    if (objects.body(id).home != none) {
      found = scene.forest ? search_forest(scene, id, hits)
                           : scene.cells.search_few(objects.grown(id, room), id, reaches[i % ahead],
                                                    hits, work_);
    }
    if (found <= few_hits)
      tell_few(scene, walks[i % edges_ahead], hits, found);
    else
      tell_many(scene, walks[i % edges_ahead], hits, found);
    reach_ahead(i + ahead);
    walk_ahead(i + edges_ahead);
    if (i + bodies_ahead < count) objects.prefetch(ids[i + bodies_ahead]);
  }
  searched_ += i;
}

// Objects that overlap this one, itself excluded; result as of Cells::search_few().
std::uint32_t Around::search_forest(const Scene& scene, ObjectId id, ObjectId* hits) {
  std::uint32_t count = 0;
  scene.forest->search(scene.objects.grown(id), scene.objects.filter(id), work_,
                       [&](ObjectId other) {
                         if (other == id || count > Cells::most_hits) return;
                         if (count < Cells::most_hits) hits[count] = other;
                         ++count;
                       });
  return count;
}

void Around::tell_begun(const Scene& scene, ObjectId id, ObjectId other) {
  if (!tells(scene.objects, id, other)) return;
  cpu::prefetch(&scene.objects.body(other));
  begun_.append({std::min(id, other), std::max(id, other), none});
}
void Around::tell_ended(const Scene& scene, ObjectId id, ObjectId other, std::uint32_t slot) {
  if (!tells(scene.objects, id, other)) return;
  cpu::prefetch(&scene.objects.body(other));
  ended_.append({std::min(id, other), std::max(id, other), slot});
}

// Removes the previous pairs from the hits; the remaining hits have begun.
void Around::tell_few(const Scene& scene, const PairSet::Walk& had, ObjectId* hits,
                      std::uint32_t count) {
  const ObjectId id = had.id;
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
  scene.pairs.each_pair(had, [&](ObjectId other, std::uint32_t slot) {
    if (!take(other, 0)) tell_ended(scene, id, other, slot);
  });
  for (std::uint32_t k = 0; k < count; ++k) {
    tell_begun(scene, id, hits[k]);
    take(hits[k], k + 1);
  }
}

// The same with a bit per object. If count > most_hits, the hits are searched for here.
void Around::tell_many(const Scene& scene, const PairSet::Walk& had, const ObjectId* hits,
                       std::uint32_t count) {
  const Objects& objects = scene.objects;
  const ObjectId id = had.id;
  const std::size_t words = objects.limit() / 64 + 1;
  if (const std::size_t before = seen_.size(); before < words) {
    seen_.reserve(words);
    seen_.resize(words);
    std::fill(seen_.begin() + before, seen_.end(), 0);
  }
  hits_.clear();
  unclean_ = true;
  const auto see = [&](ObjectId other) {  // may include the object itself, which is not reported
    if (is_seen(other) || !objects.may_pair(id, other)) return;
    hits_.append(other);
    flip(other);
  };
  if (count <= Cells::most_hits) {
    std::for_each(hits, hits + count, see);
  } else if (scene.forest) {
    scene.forest->search(objects.grown(id), objects.filter(id), work_, see);
  } else {
    scene.cells.search_many(objects.grown(id), worlds_of(objects, objects.filter(id)), work_, see);
  }
  scene.pairs.each_pair(had, [&](ObjectId other, std::uint32_t slot) {
    if (is_seen(other))
      flip(other);
    else
      tell_ended(scene, id, other, slot);
  });
  for (const ObjectId other : hits_) {
    if (!is_seen(other)) continue;
    flip(other);
    tell_begun(scene, id, other);
  }
  unclean_ = false;
}

}  // namespace throng::live
