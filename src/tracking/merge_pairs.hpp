// Merges all pairs of a full search with the existing ones: pairs that begin, pairs that end, and
// the slots of the others.
#pragma once

#include <cstddef>

#include <throng/broad_phase.hpp>

namespace throng::tracking {

// Both lists are sorted.
struct MergeInput {
  const Pair* pairs;
  std::size_t count;
  const LivePair* existing;
  std::size_t existing_count;
};

// A part of the input: new pairs [begin, end), existing pairs [existing_begin, existing_end); its
// event counts, and those of all parts before it.
struct MergePart {
  std::size_t begin, end, existing_begin, existing_end;
  std::size_t begun, ended, begun_before, ended_before;
};

// Output; each task writes its own parts. `pairs`: all new pairs with their existing slots.
// `begun`: from `begin` on, with the pair's index instead of a slot. `ended`: from `existing_begin`
// on, with slots.
struct MergeOutput {
  LivePair *pairs, *begun, *ended;
};

// Divides the input into an even number of parts that begin at the same pair in both lists; returns
// how many.
constexpr unsigned max_merge_parts = 256;
unsigned divide(const MergeInput&, unsigned tasks, MergePart* parts) noexcept;

// Merges two parts and sets their event counts.
//
// Indices are stored in 32 bits. That suffices: the caller must have refused 2^32 - 1 or more slots
// before, and there are at least as many slots as pairs, since existing pairs keep theirs and each
// new pair gets one.
void merge(const MergeInput&, const MergeOutput&, MergePart& first, MergePart& second) noexcept;

}  // namespace throng::tracking
