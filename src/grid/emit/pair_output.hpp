// Where kernels write the pairs that they find.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

namespace throng::grid {

// How the ids of a query and a target form a pair. `unordered`: the lesser is first;
// PairOutput::target_id_offset, the offset of the second set's ids, is subtracted from the other.
enum class Orientation : std::uint8_t { unordered, query_first, target_first };

// Two cursors: confirmed pairs, and quantization ties, which the floats decide. A kernel writes at
// a cursor, then checks it against its limit.
class PairOutput {
 public:
  // A kernel may write so many pairs beyond a cursor before it checks the limit.
  static constexpr std::size_t slack = 64;

  Pair* cursor = nullptr;
  Pair* limit = nullptr;
  Pair* tie_cursor = nullptr;
  Pair* tie_limit = nullptr;
  // Called once a cursor is beyond its limit; they make room and set both.
  virtual void flush() = 0;
  virtual void flush_ties() = 0;

  std::uint32_t target_id_offset = 0;
  std::uint64_t comparisons = 0;
  std::uint64_t visited = 0;  // see Result

 protected:
  PairOutput() = default;
  ~PairOutput() = default;
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
