#include "mpi/share.hpp"

#include <algorithm>

#include <throng/cuda.hpp>

#include "mpi/balance.hpp"

namespace throng::mpi {
namespace {

constexpr std::uint8_t all_above = 7;
// From so many boxes on Backend::automatic may take a GPU (Backend, options.hpp).
constexpr std::size_t gpu_from = 500000;

void add(Result& sum, const Result& r) noexcept {
  sum.comparisons += r.comparisons;
  sum.times.plan_ms += r.times.plan_ms;
  sum.times.bin_ms += r.times.bin_ms;
  sum.times.find_ms += r.times.find_ms;
  sum.times.order_ms += r.times.order_ms;
  sum.times.total_ms += r.times.total_ms;
}

}  // namespace

// A GPU pays for each call, the CPU next to nothing.
bool Share::may_part(const Options& options) {
  if (known_ > 0xffffffffu) return false;
  if (options.backend == Backend::cpu) return true;
  if (options.backend != Backend::automatic) return false;
  if (known_ >= gpu_from && has_gpu_ < 0) has_gpu_ = cuda::available().ok();
  return known_ < gpu_from || has_gpu_ == 0;
}

Result Share::search(const Options& options, const Bounds& region, const LocalSet* const* sets,
                     int count) {
  pairs_.clear();
  points_.clear();
  home_ = searched_ = 0;
  known_ = sets[0]->size() + (count == 2 ? sets[1]->size() : 0);
  margin_ = options.margin;
  finder_.set_options(options);
  std::vector<Reach> sample;
  if (may_part(options)) {
    for (const std::size_t i : Parts::sample(known_)) {
      const std::size_t size = sets[0]->size();
      const Box& box = i < size ? sets[0]->box(i) : sets[1]->box(i - size);
      sample.push_back(reach_of(box, margin_));
    }
  }
  const Parts parts(region, std::move(sample));
  parts_ = parts.count();
  if (parts_ == 1) return search_part(region, sets, count);
  deal(parts, sets, count);
  Result sum;
  std::size_t begin = 0, largest = 0;
  for (std::size_t p = 0; p < parts_; ++p) {
    LocalSet some[2] = {LocalSet(sets[0]->filters()), LocalSet(sets[count - 1]->filters())};
    const LocalSet* of_part[2] = {&some[0], &some[1]};
    for (std::size_t i = begin; i < ends_[p]; ++i) {
      const std::size_t size = sets[0]->size(), box = boxes_[i];
      const int s = box < size ? 0 : 1;
      some[s].add(*sets[s], s == 0 ? box : box - size);
    }
    const Result r = search_part(parts.bounds(p), of_part, count);
    if (!r.ok()) return r;
    add(sum, r);
    if (ends_[p] - begin > largest) {
      largest = ends_[p] - begin;
      sum.plan = r.plan;
    }
    begin = ends_[p];
  }
  return sum;
}

// The boxes of each part, in their order; those that cross into it come last.
void Share::deal(const Parts& parts, const LocalSet* const* sets, int count) {
  std::vector<std::pair<std::size_t, std::uint32_t>> crossing;  // beyond the first part: part, box
  part_.resize(known_);
  ends_.assign(parts_ + 1, 0);
  std::uint32_t at = 0;
  for (int s = 0; s < count; ++s) {
    for (std::size_t i = 0; i < sets[s]->size(); ++i, ++at) {
      bool first = true;
      parts.visit(reach_of(sets[s]->box(i), margin_), [&](std::size_t part) {
        if (first) {
          part_[at] = static_cast<std::uint32_t>(part);
        } else {
          crossing.emplace_back(part, at);
        }
        ++ends_[part + 1];
        first = false;
      });
    }
  }
  for (std::size_t p = 0; p < parts_; ++p) ends_[p + 1] += ends_[p];
  boxes_.resize(ends_.back());
  // Each begin moves on to its end.
  for (std::size_t i = 0; i < known_; ++i) {
    boxes_[ends_[part_[i]]++] = static_cast<std::uint32_t>(i);
  }
  for (const auto& [part, box] : crossing) boxes_[ends_[part]++] = box;
  ends_.pop_back();
}

// The pairs whose home corner lies in this part of the region, or in all of it.
Result Share::search_part(const Bounds& part, const LocalSet* const* sets, int count) {
  for (int s = 0; s < count; ++s) {
    above_[s].resize(sets[s]->size());
    halves_[s].assign(sets[s]->size(), 0);
    for (std::size_t i = 0; i < sets[s]->size(); ++i) {
      const Reach reach = reach_of(sets[s]->box(i), margin_);
      std::uint8_t bits = 0;
      for (int k = 0; k < 3; ++k) {
        bits |= static_cast<std::uint8_t>((reach.lower[k] >= part.lower[k]) << k);
      }
      above_[s][i] = bits;
      home_ += bits == all_above;
    }
    searched_ += sets[s]->size();
  }
  const LocalSet &a = *sets[0], &b = *sets[count - 1];
  const Result r = count == 1 ? finder_.find(a.view()) : finder_.find(a.view(), b.view());
  if (!r.ok()) return r;
  // Both boxes reach this part, so their home corner is below its upper end on every axis; it is
  // here where on each axis one of the two lower corners is not below the lower end.
  const int second_set = count - 1;
  for (const Pair pair : finder_.pairs()) {
    const std::uint8_t one = above_[0][pair.first], two = above_[second_set][pair.second];
    if ((one | two) != all_above) continue;
    std::uint64_t first = a.id(pair.first), second = b.id(pair.second);
    if (count == 1 && first > second) std::swap(first, second);
    pairs_.push_back({first, second});
    // Weighed where it is at home: it is cut off with that one.
    const std::uint32_t halves = one == two ? 1 : 2;
    if (one == all_above) halves_[0][pair.first] += halves;
    if (two == all_above) halves_[second_set][pair.second] += halves;
  }
  for (int s = 0; s < count; ++s) {
    for (std::size_t i = 0; i < sets[s]->size(); ++i) {
      if (above_[s][i] != all_above) continue;
      add_point(points_, reach_of(sets[s]->box(i), margin_), halves_[s][i] * pair_work / 2);
    }
  }
  return r;
}

}  // namespace throng::mpi
