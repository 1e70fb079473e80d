// Index of a sorted list of pairs by object.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "tracking/pod_vector.hpp"

namespace throng::tracking {

class PairsByObject {
 public:
  explicit PairsByObject(base::Memory& memory) noexcept;

  // From sorted pairs; ids are below `limit`.
  void make(const PodVector<LivePair>& pairs, std::size_t limit);
  // Returns how many pairs an object has; writes them in sorted order if `capacity` is enough.
  // `pairs`: the list passed to make().
  std::size_t of(const PodVector<LivePair>& pairs, ObjectId id, LivePair* out,
                 std::size_t capacity) const noexcept;

 private:
  // firsts_: begin of the pairs in which the object is first. seconds_: begin, in places_, of the
  // indices of the pairs in which it is second. Each range ends where that of the next object
  // begins.
  PodVector<std::uint32_t> firsts_, seconds_;
  PodVector<std::uint32_t> places_;
};

}  // namespace throng::tracking
