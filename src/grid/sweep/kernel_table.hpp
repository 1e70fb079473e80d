// The inner loops: one table of functions per instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

#include "base/quantize.hpp"
#include "grid/emit/emit.hpp"
#include "grid/plan/planner.hpp"

namespace throng::grid {

// A box in a column: its quantized coordinates there, and its index. See base/quantize.hpp.
struct Record {
  std::uint16_t lower[3], upper[3];
  std::uint32_t id;
};
static_assert(sizeof(Record) == 16);

// A box that touches too many columns for one record in each: its quantized bounds on three axes.
struct WideBox {
  std::int32_t lower[3];
  std::int32_t upper[3];
  std::uint32_t id;
  std::uint32_t column_offset;  // as in BinTarget
};

// The result of binning one box, packed in 32 bits. Low bits: the column of the lower corner.
// Above, two bits per axis: the upper corner lies in the same column (0), the next one (1), or
// further (2). An invalid box (not lower <= upper) also has a 2.
constexpr std::uint32_t column_bits = 18;
constexpr std::uint32_t max_columns = 1u << column_bits;
constexpr std::uint32_t needs_slow_path = 0b101010u << column_bits;

constexpr std::uint32_t bin_tile = 256;
// Boxes are read in groups of this size. Reads go to the end of the last group, plus one float.
constexpr std::uint32_t bin_group = 4;

// The destination of one task's records: a chain of blocks per column. A tail is the address of the
// next free record; a tail that is a multiple of the block size (null included) needs a new block.
struct BinTarget {
  std::uintptr_t* tail = nullptr;
  std::uintptr_t block_mask = 0;  // block size - 1
  std::uintptr_t (*next_block)(BinTarget*,
                               std::uint32_t column) = nullptr;  // address of its first record

  // Address of the column's next record.
  std::uintptr_t next_slot(std::uint32_t column) {
    const std::uintptr_t at = tail[column];
    if ((at & block_mask) != 0) [[likely]]
      return at;
    return next_block(this, column);
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
  // needs_slow_path, and the box is left to the caller. Null: all 0. Must be readable for full
  // vectors, as the boxes are.
  const std::uint32_t* column_offset = nullptr;

  // Of the last tile:
  std::uint32_t deferred_count = 0;
  std::uint32_t deferred[bin_tile];  // positions of the boxes that were not entered
  // Lower coordinates in the box's first column, upper coordinates in its last.
  alignas(64) Record first_column_record[bin_tile];
  alignas(64) std::uint32_t number[bin_tile];  // as packed by column_bits
};

// A column's boxes as structure of arrays, ordered by their lower coordinate on the sweep axis to
// the precision of a bucket. Axis 0 is the sweep axis. The arrays are readable for `strip_padding`
// entries after `count`; no padding entry matches.
constexpr std::uint32_t strip_padding = 128;
constexpr std::uint32_t record_padding = 32;
struct Strip {
  std::uint32_t count = 0;
  std::uint32_t shift = 0;  // bucket = (coordinate >> shift) - first_bucket
  std::uint32_t first_bucket = 0, bucket_count = 0;
  std::int16_t* lower[3] = {};
  std::int16_t* upper[3] = {};
  // A pair is rejected if the query's `query_reject_bits` and the target's `target_reject_bits`
  // share a bit. One bit per axis: the box starts in an earlier column. Further bits: filter
  // classes (see FilterClasses). Without filter classes both pointers name the same array.
  std::int16_t* target_reject_bits = nullptr;
  std::int16_t* query_reject_bits = nullptr;
  std::uint32_t* id = nullptr;
  // The same boxes as records, with axes in spatial order; readable for `record_padding` more.
  const Record* const* record = nullptr;
  std::uint32_t axis = 0;  // the sweep axis in space
  const std::uint32_t* bucket_end = nullptr;
  // Every box is at least one bucket long on the sweep axis. Then no box of the strip ends before a
  // later one starts, so one of the two comparisons on that axis is not needed.
  bool long_boxes = false;
  bool has_overrides = false;  // `id`, `target_reject_bits` and `query_reject_bits` differ from the
                               // records; see ParentCell and FilterClasses

  std::uint32_t bucket_of(int word) const noexcept {
    return (static_cast<std::uint32_t>(word) >> shift) - first_bucket;
  }
};

struct SweepArgs {
  const Strip* queries = nullptr;
  const Strip* targets = nullptr;
  const std::uint32_t* start = nullptr;  // first target of each query; null: the next box
  Orientation orientation = Orientation::unordered;
  std::uint32_t begin = 0, end = ~0u;  // queries; multiples of sweep_piece, or the last
};
constexpr std::uint32_t sweep_piece = 256;

// Boxes as floats, one array per coordinate, readable for 16 more. Inactive boxes are all NaN.
struct Tile {
  const float* corner[6];
  const std::uint32_t* id;
  std::uint32_t count;
};

// The pairs of one `first`: their `second` values, and the destination of the pairs. `seconds` may
// be the latter half of that destination.
struct PairList {
  const std::uint32_t* seconds = nullptr;
  Pair* to = nullptr;
  std::uint32_t count = 0;
  std::uint32_t first = 0;
};
// Lists sorted side by side in vector lanes.
constexpr std::uint32_t lists_per_sort = 16;

// Pairs as 32-bit keys: the low bits of first, then those of second. The keys are sorted except
// within runs of at most `longest`; no key belongs in another run.
struct KeyRuns {
  std::uint32_t* keys;  // writable for run_padding more
  std::size_t count;
  std::uint32_t longest;
  std::uint32_t first_above;  // the remaining high bits of first
  unsigned second_bits;       // below 32
};
constexpr std::size_t run_padding = 16;

// The filter values of a tile of boxes, as arrays. Absent filters hold neutral values.
constexpr std::uint32_t filter_tile = 256;
struct FilterTile {
  const std::uint32_t *group, *mask;
  const std::uint8_t* is_static;
};
struct FilterCombination {
  std::uint32_t group, mask;
  std::uint32_t is_static;  // 0 or 1
  bool operator==(const FilterCombination&) const = default;
};
constexpr std::uint8_t unknown_class = 0xff;

// The range of worlds of some boxes. World -1 (meets every world) is the greatest unsigned and the
// least signed value, so it is neither end of the range if there is any other.
struct WorldRange {
  std::uint32_t least = 0xffffffffu;
  std::int32_t greatest = -1;
  std::uint64_t in_all_worlds = 0;  // boxes in world -1

  bool several() const noexcept { return static_cast<std::int32_t>(least) < greatest; }
  void add(const WorldRange& other) noexcept {
    least = other.least < least ? other.least : least;
    greatest = other.greatest > greatest ? other.greatest : greatest;
    in_all_worlds += other.in_all_worlds;
  }
};

struct Kernels {
  Isa isa;
  SweepCost sweep_cost;
  // Bins `count` <= bin_tile boxes, `stride` bytes apart: appends one record per column that a box
  // touches. Lists the boxes that it leaves to the caller: invalid boxes, and those that
  // touch three or more columns on an axis; the scalar kernel leaves all that touch more than one.
  // Reads to the end of the last bin_group, plus one float. ids null: first_id, first_id + 1, ...
  void (*bin)(const base::Quantizer&, const char* boxes, std::size_t stride,
              const std::uint32_t* ids, std::uint32_t first_id, std::uint32_t count, BinTarget&);
  // Merges the least and greatest lower coordinate on `axis` into *least and *most.
  void (*quantized_range)(const Record*, std::uint32_t count, std::uint32_t axis,
                          std::uint32_t* least, std::uint32_t* most);
  // Fills a strip's arrays from its records.
  void (*transpose)(Strip&);
  void (*sweep)(const SweepArgs&, Emit&);
  // Sets filter_classes[i] to the index of the known combination (below unknown_class) that box i
  // has, the last if several are equal; else to unknown_class. Returns false if any box is unknown.
  bool (*match_filter_classes)(const FilterTile&, const FilterCombination* known,
                               std::uint32_t known_count, std::uint8_t* filter_classes);
  // Merges the worlds of `count` <= filter_tile boxes. All filter_tile values must be readable and
  // taken from these boxes.
  void (*read_worlds)(const std::int32_t* worlds, std::uint32_t count, WorldRange&);
  // Tests every query against every target; within one tile each pair once.
  void (*all_pairs)(const Tile& queries, const Tile& targets, bool same, Orientation, Emit&);
  // Sorts each of `lists_per_sort` lists by its seconds. `rows` is the longest list's length
  // rounded up to a multiple of 8; `scratch` has rows * lists_per_sort values. Like sort_runs, null
  // where vectors are too short for it to pay.
  void (*sort_lists)(const PairList* lists, std::uint32_t rows, std::uint32_t* scratch);
  // Sorts the keys and writes the pairs that they encode.
  void (*sort_runs)(const KeyRuns&, Pair* to);
};

// The table of an instruction set; null if this build or processor lacks it. automatic: the one
// that THRONG_ISA names, else the widest.
const Kernels* find_kernels(Isa) noexcept;

extern const Kernels scalar_kernels;

// The same for vector instruction sets only; null where absent.
const Kernels* simd_kernels(Isa) noexcept;

}  // namespace throng::grid
