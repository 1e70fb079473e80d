// Which pairs of a sorted list each object has.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "live/list.hpp"

namespace throng::live {

class PairsByObject {
 public:
  explicit PairsByObject(cpu::Memory& memory) noexcept;

  // Of pairs in canonical order; ids are below `limit`.
  void make(const List<LivePair>& pairs, std::size_t limit);
  // Those of one object in canonical order, if `out` has room for them all; returns how many there
  // are. The pairs are those that it was made of.
  std::size_t of(const List<LivePair>& pairs, ObjectId id, LivePair* out,
                 std::size_t room) const noexcept;

 private:
  // Where the pairs begin of which an object is the first; and, in places_, the places of those of
  // which it is the second. Each ends where that of the next object begins.
  List<std::uint32_t> firsts_, seconds_;
  List<std::uint32_t> places_;
};

}  // namespace throng::live
