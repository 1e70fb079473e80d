// All pairs, found anew, merged with those that lived: what began, what ended, and which slot each
// of the others has.
#pragma once

#include <cstddef>

#include <throng/broad_phase.hpp>

namespace throng::live {

// Both in canonical order.
struct MergeInput {
  const Pair* pairs;
  std::size_t count;
  const LivePair* live;
  std::size_t live_count;
};

// A part of it: new pairs [begin, end), live ones [live_begin, live_end); how many of them begin
// and end, and how many of all parts before it.
struct MergePart {
  std::size_t begin, end, live_begin, live_end;
  std::size_t begun, ended, begun_before, ended_before;
};

// What tasks write, each for its own parts. `pairs`: all new ones with the slots that they had.
// What begins lies from `begin` on in `begun`, with its index in the place of a slot; what ends
// from `live_begin` on in `ended`, with its slot.
struct MergeOutput {
  LivePair *pairs, *begun, *ended;
};

// Divides into parts that begin at the same pair in both lists, an even number; tells how many.
constexpr unsigned most_merge_parts = 256;
unsigned divide(const MergeInput&, unsigned tasks, MergePart* parts) noexcept;

// Two parts at once, and how many of each begin and end.
//
// An index is cut to 32 bits, and that is enough. Whoever uses it must have refused 2^32 - 1 slots
// or more before, and there are as many slots as pairs at least: those that lived keep theirs, and
// each that begins gets one.
void merge(const MergeInput&, const MergeOutput&, MergePart& first, MergePart& second) noexcept;

}  // namespace throng::live
