#include "mpi/region_search.hpp"

#include <algorithm>

#include <throng/cuda.hpp>

#include "mpi/balance.hpp"

namespace throng::mpi {
namespace {

constexpr std::uint8_t all_above = 7;
// The number of boxes from which Backend::automatic may take a GPU (Backend, options.hpp).
constexpr std::size_t min_gpu_boxes = 200000;

}  // namespace

// Each call has an overhead on a GPU, almost none on the CPU.
bool RegionSearch::may_split(const Options& options) {
  if (options.backend == Backend::cpu) return true;
  if (options.backend != Backend::automatic) return false;
  if (owned_and_ghost_ >= min_gpu_boxes && has_gpu_ < 0) has_gpu_ = cuda::available().ok();
  return owned_and_ghost_ < min_gpu_boxes || has_gpu_ == 0;
}

Result RegionSearch::search(const Options& options, bool in_parts, const Bounds& region,
                            const LocalSet* const* sets, int count) {
  pairs_.clear();
  points_.clear();
  owned_ = searched_ = 0;
  owned_and_ghost_ = sets[0]->size() + (count == 2 ? sets[1]->size() : 0);
  margin_ = options.margin;
  finder_.set_options(options);
  std::vector<KeyBox> sample;
  if (in_parts && may_split(options)) {
    for (const std::size_t i : GapPartition::sample(owned_and_ghost_)) {
      const std::size_t size = sets[0]->size();
      const Box& box = i < size ? sets[0]->box(i) : sets[1]->box(i - size);
      sample.push_back(key_box_of(box, margin_));
    }
  }
  const GapPartition parts(region, std::move(sample));
  parts_ = parts.count();
  if (parts_ == 1) return search_part(region, sets, count);
  for (int s = 0; s < count; ++s) distribute(parts, *sets[s], distributed_[s]);
  Result sum;
  std::size_t largest = 0;
  for (std::size_t p = 0; p < parts_; ++p) {
    const LocalSet* const of_part[] = {&distributed_[0][p], &distributed_[count - 1][p]};
    const std::size_t before = searched_;
    const Result r = search_part(parts.bounds(p), of_part, count);
    if (!r.ok()) return r;
    sum.comparisons += r.comparisons;
    sum.visited += r.visited;
    sum.times += r.times;
    if (searched_ - before > largest) {
      largest = searched_ - before;
      sum.plan = r.plan;
    }
  }
  return sum;
}

// Distributes the boxes to the parts that they overlap.
void RegionSearch::distribute(const GapPartition& parts, const LocalSet& set,
                              std::vector<LocalSet>& distributed) {
  lists_.resize(std::max(parts_, lists_.size()));
  for (std::vector<std::uint32_t>& list : lists_) list.clear();
  KeyBox key_boxes[GapPartition::batch];
  std::uint32_t found[GapPartition::batch];
  for (std::size_t first = 0; first < set.size(); first += GapPartition::batch) {
    const std::size_t n = std::min(GapPartition::batch, set.size() - first);
    for (std::size_t i = 0; i < n; ++i) key_boxes[i] = key_box_of(set.box(first + i), margin_);
    parts.locate(key_boxes, n, found);
    for (std::size_t i = 0; i < n; ++i) {
      const auto box = static_cast<std::uint32_t>(first + i);
      if (found[i] != GapPartition::several) {
        lists_[found[i]].push_back(box);
      } else {
        parts.visit(key_boxes[i], [&](std::size_t part) { lists_[part].push_back(box); });
      }
    }
  }
  distributed.resize(std::max(parts_, distributed.size()));
  for (std::size_t p = 0; p < parts_; ++p)
    distributed[p].gather(set, lists_[p].data(), lists_[p].size());
}

// Finds the pairs whose reference corner lies in this part of the region.
Result RegionSearch::search_part(const Bounds& part, const LocalSet* const* sets, int count) {
  for (int s = 0; s < count; ++s) {
    above_[s].resize(sets[s]->size());
    halves_[s].assign(sets[s]->size(), 0);
    for (std::size_t i = 0; i < sets[s]->size(); ++i) {
      const KeyBox key_box = key_box_of(sets[s]->box(i), margin_);
      std::uint8_t bits = 0;
      for (int k = 0; k < 3; ++k) {
        bits |= static_cast<std::uint8_t>((key_box.lower[k] >= part.lower[k]) << k);
      }
      above_[s][i] = bits;
      owned_ += bits == all_above;
    }
    searched_ += sets[s]->size();
  }
  const LocalSet &a = *sets[0], &b = *sets[count - 1];
  const Result r = count == 1 ? finder_.find(a.view()) : finder_.find(a.view(), b.view());
  if (!r.ok()) return r;
  // Both boxes overlap this part, so the reference corner is below the part's upper bound on every
  // axis. It lies in the part if on each axis at least one lower corner is not below the lower
  // bound.
  const int second_set = count - 1;
  for (const Pair pair : finder_.pairs()) {
    const std::uint8_t one = above_[0][pair.first], two = above_[second_set][pair.second];
    if ((one | two) != all_above) continue;
    std::uint64_t first = a.id(pair.first), second = b.id(pair.second);
    if (count == 1 && first > second) std::swap(first, second);
    pairs_.push_back({first, second});
    // A pair is charged to the box that owns its reference corner's region, which moves with the
    // cut.
    const std::uint32_t halves = one == two ? 1 : 2;
    if (one == all_above) halves_[0][pair.first] += halves;
    if (two == all_above) halves_[second_set][pair.second] += halves;
  }
  for (int s = 0; s < count; ++s) {
    for (std::size_t i = 0; i < sets[s]->size(); ++i) {
      if (above_[s][i] != all_above) continue;
      add_point(points_, key_box_of(sets[s]->box(i), margin_), halves_[s][i] * pair_work / 2);
    }
  }
  return r;
}

}  // namespace throng::mpi
