// Where the binning kernels write records.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/padded_array.hpp"
#include "grid/sweep/record.hpp"

namespace throng::grid {

// The result of binning one box, packed in 32 bits. Low bits: the column of the lower corner.
// Above, two bits per axis: the upper corner lies in the same column (0), the next one (1), or
// further (2). An invalid box (not lower <= upper) also has a 2.
constexpr std::uint32_t column_bits = 18;
constexpr std::uint32_t max_columns = 1u << column_bits;
constexpr std::uint32_t needs_slow_path = 0b101010u << column_bits;

constexpr std::uint32_t bin_tile = 256;
// Boxes are read in groups of this size. Reads go to the end of the last group, plus one float.
constexpr std::uint32_t bin_group = 4;

// Boxes that a kernel bins by one call: at most bin_tile, `stride` bytes apart. Their ids, or
// first_id, first_id + 1, ... if `ids` is null.
struct BinInput {
  const char* boxes;
  std::size_t stride;
  std::uint32_t count;
  const std::uint32_t* ids;
  std::uint32_t first_id;
};

// The destination of one task's records: a chain of blocks per column. A tail is the address of the
// next free record; a tail that is a multiple of the block size (null included) needs a new block.
class RecordOutput {
 public:
  std::uintptr_t* tail = nullptr;
  std::uintptr_t block_mask = 0;  // block size - 1
  // Called where a column needs a block. Returns the address of the block's first record.
  virtual std::uintptr_t next_block(std::uint32_t column) = 0;

  // Address of the column's next record.
  std::uintptr_t next_slot(std::uint32_t column) {
    const std::uintptr_t at = tail[column];
    if ((at & block_mask) != 0) [[likely]]
      return at;
    return next_block(column);
  }

  // Optional write-combining: each column has a buffer of 1 << buffer_bits bytes, which goes to its
  // block with streaming stores once it is full. Without it the records would evict cached data,
  // although they are read only after all binning is done. A block is a multiple of a buffer.
  char* buffers = nullptr;
  unsigned buffer_bits = 0;

  std::uintptr_t buffer_mask() const { return (std::uintptr_t{1} << buffer_bits) - 1; }
  char* buffer(std::uint32_t column) const {
    return buffers + (std::size_t{column} << buffer_bits);
  }

  // Per box of a tile, added to its column number: the first column of its world; or
  // needs_slow_path, and the box is left to the caller. Empty: all 0.
  base::PaddedArray<std::uint32_t, 16> column_offset;

  // Of the last tile:
  std::uint32_t deferred_count = 0;
  std::uint32_t deferred[bin_tile];  // positions of the boxes that were not entered
  // Lower coordinates in the box's first column, upper coordinates in its last.
  alignas(64) Record first_column_record[bin_tile];
  alignas(64) std::uint32_t number[bin_tile];  // as packed by column_bits

 protected:
  // The last three are written before they are read.
  // cppcheck-suppress uninitMemberVar
  RecordOutput() = default;
  ~RecordOutput() = default;
};

}  // namespace throng::grid
