// Where a kernel leaves the pairs that it finds.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

namespace throng::cpu {

// A kernel may write up to `slack` pairs beyond a cursor before it looks at the limit again.
constexpr std::size_t emit_slack = 64;

// How the ids of a query and of a target become a pair: `unordered`, the lesser is first, and the
// other less Emit::second_base, which ids of a second set have been raised by, second.
enum class Orientation : std::uint8_t { unordered, query_first, target_first };

struct Emit {
  Pair* cursor = nullptr;        // sure pairs
  Pair* limit = nullptr;         // cursor > limit: call flush
  Pair* maybe_cursor = nullptr;  // pairs that the floats must decide
  Pair* maybe_limit = nullptr;
  void (*flush)(Emit*) = nullptr;
  void (*flush_maybe)(Emit*) = nullptr;
  std::uint32_t second_base = 0;
  std::uint64_t comparisons = 0;
  std::uint64_t visited = 0;  // see Result
};

inline Pair make_pair(Orientation orientation, std::uint32_t query, std::uint32_t target,
                      std::uint32_t second_base = 0) noexcept {
  if (orientation == Orientation::query_first) return {query, target};
  if (orientation == Orientation::target_first) return {target, query};
  // Of std::min and std::max together GCC makes a branch, which is guessed wrong every other time.
  const std::uint32_t least = std::min(query, target);
  return {least, (query ^ target ^ least) - second_base};
}

}  // namespace throng::cpu
