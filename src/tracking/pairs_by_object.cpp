#include "tracking/pairs_by_object.hpp"

namespace throng::tracking {

PairsByObject::PairsByObject(base::Memory& memory) noexcept
    : firsts_(memory), seconds_(memory), places_(memory) {}

void PairsByObject::make(const PodVector<LivePair>& pairs, std::size_t limit) {
  firsts_.reserve_discard(limit + 1);
  seconds_.reserve_discard(limit + 2);
  places_.reserve_discard(pairs.size());
  firsts_.resize(limit + 1);
  seconds_.resize(limit + 2);
  places_.resize(pairs.size());
  for (std::uint32_t& begin : seconds_) begin = 0;
  std::size_t id = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (; id <= pairs[i].first; ++id) firsts_[id] = static_cast<std::uint32_t>(i);
    ++seconds_[pairs[i].second + 2];
  }
  for (; id <= limit; ++id) firsts_[id] = static_cast<std::uint32_t>(pairs.size());
  // Offset by one, so that the begins are correct after the scatter.
  for (std::size_t k = 1; k < seconds_.size(); ++k) seconds_[k] += seconds_[k - 1];
  for (std::size_t i = 0; i < pairs.size(); ++i)
    places_[seconds_[pairs[i].second + 1]++] = static_cast<std::uint32_t>(i);
}

std::size_t PairsByObject::of(const PodVector<LivePair>& pairs, ObjectId id, LivePair* out,
                              std::size_t capacity) const noexcept {
  if (id + std::size_t{1} >= firsts_.size()) return 0;  // added later
  const std::uint32_t first = firsts_[id], second = seconds_[id];
  const std::size_t as_first = firsts_[id + 1] - first, as_second = seconds_[id + 1] - second;
  const std::size_t count = as_first + as_second;
  if (count > capacity) return count;
  for (std::size_t k = 0; k < as_second; ++k) out[k] = pairs[places_[second + k]];
  for (std::size_t k = 0; k < as_first; ++k) out[as_second + k] = pairs[first + k];
  return count;
}

}  // namespace throng::tracking
