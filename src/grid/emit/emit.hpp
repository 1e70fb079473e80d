// The output interface of kernels: cursors for the pairs that they find.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

namespace throng::grid {

// A kernel may write up to `emit_slack` pairs beyond a cursor before it checks the limit again.
constexpr std::size_t emit_slack = 64;

// How the ids of a query and a target form a pair. `unordered`: the lesser is first;
// Emit::target_id_offset, the offset of the second set's ids, is subtracted from the other.
enum class Orientation : std::uint8_t { unordered, query_first, target_first };

struct Emit {
  Pair* cursor = nullptr;      // confirmed pairs
  Pair* limit = nullptr;       // cursor > limit: call flush
  Pair* tie_cursor = nullptr;  // quantization ties: the floats decide
  Pair* tie_limit = nullptr;
  void (*flush)(Emit*) = nullptr;
  void (*flush_ties)(Emit*) = nullptr;
  std::uint32_t target_id_offset = 0;
  std::uint64_t comparisons = 0;
  std::uint64_t visited = 0;  // see Result
};

inline Pair make_pair(Orientation orientation, std::uint32_t query, std::uint32_t target,
                      std::uint32_t target_id_offset = 0) noexcept {
  if (orientation == Orientation::query_first) return {query, target};
  if (orientation == Orientation::target_first) return {target, query};
  // GCC compiles std::min plus std::max to a branch, which is mispredicted half the time.
  const std::uint32_t least = std::min(query, target);
  return {least, (query ^ target ^ least) - target_id_offset};
}

}  // namespace throng::grid
