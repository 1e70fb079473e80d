// The inner loops, one set of them an instruction set, behind one table.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

#include "core/planner.hpp"
#include "core/quantise.hpp"
#include "cpu/emit.hpp"

namespace throng::cpu {

// A box in a column: the words of its ends there, and its index. See core/quantise.hpp.
struct Record {
  std::uint16_t lower[3], upper[3];
  std::uint32_t id;
};
static_assert(sizeof(Record) == 16);

// A box that touches too many columns for a record in each: the quantised ends of its three axes.
struct Spanning {
  std::int32_t lower[3];
  std::int32_t upper[3];
  std::uint32_t id;
  std::uint32_t place;  // as in BinTarget
};

// What binning finds out of a box, in one number: its column, of the lower corner, in the low bits;
// above, two bits for each axis, which tell whether the upper corner lies in the same column (0),
// one further (1), or beyond that (2). What is no box at all (not lower <= upper) has a 2, too.
constexpr std::uint32_t column_bits = 18;
constexpr std::uint32_t most_columns = 1u << column_bits;
constexpr std::uint32_t beyond_next = 0b101010u << column_bits;

constexpr std::uint32_t bin_tile = 256;
// Boxes are read in groups of so many, the last one whole, and a float beyond.
constexpr std::uint32_t bin_group = 4;

// Where the records of one task go: per column a chain of blocks. A tail is the address of the next
// free record; one that is a multiple of the block's size (null too) asks for a new block.
struct BinTarget {
  std::uintptr_t* tail = nullptr;
  std::uintptr_t block_mask = 0;  // block size - 1
  std::uintptr_t (*next_block)(BinTarget*,
                               std::uint32_t column) = nullptr;  // address of its first record

  // Where the column's next record goes.
  std::uintptr_t room(std::uint32_t column) {
    const std::uintptr_t at = tail[column];
    if ((at & block_mask) != 0) [[likely]]
      return at;
    return next_block(this, column);
  }

  // Where given, a column's last records wait in a buffer of its own, 1 << buffer_bits bytes, and
  // go to their place in memory together once it is full: written past the caches, which have no
  // room for what is read again only after all else was written. A block is a multiple of a buffer.
  char* buffers = nullptr;
  unsigned buffer_bits = 0;

  std::uintptr_t buffer_mask() const { return (std::uintptr_t{1} << buffer_bits) - 1; }
  char* buffer(std::uint32_t column) const {
    return buffers + (std::size_t{column} << buffer_bits);
  }

  // Of each box of a tile, added to its column's number: where its world's columns begin; or
  // beyond_next, and it is left to the caller. Null: 0. Readable as boxes are, a vector's worth.
  const std::uint32_t* place = nullptr;

  // Of the last tile.
  std::uint32_t odd_count = 0;
  std::uint32_t odd[bin_tile];  // positions of the boxes that were not entered
  // Lower words of the box's first column, upper words of its last.
  alignas(64) Record whole[bin_tile];
  alignas(64) std::uint32_t number[bin_tile];  // see above
};

// A column's boxes in order of their sweep axis' lower words, up to the width of a bucket; one
// array a word, axis 0 being the sweep axis. The arrays are readable `strip_padding` beyond
// `count`, where no box matches.
constexpr std::uint32_t strip_padding = 128;
constexpr std::uint32_t record_padding = 32;
struct Strip {
  std::uint32_t count = 0;
  std::uint32_t shift = 0;  // bucket = (word >> shift) - first_bucket
  std::uint32_t first_bucket = 0, bucket_count = 0;
  std::int16_t* lower[3] = {};
  std::int16_t* upper[3] = {};
  // Two boxes that have a bit in common, one's as a query and the other's as a target, are not told
  // of: a bit for each axis, that the box begins in an earlier column, and those of Kinds. Of a
  // query both words are the same array where there are no kinds.
  std::int16_t* begins = nullptr;
  std::int16_t* asks = nullptr;
  std::uint32_t* id = nullptr;
  // The same boxes as records, their axes as in space; `record_padding` more are readable.
  const Record* const* record = nullptr;
  std::uint32_t axis = 0;  // the sweep axis in space
  const std::uint32_t* bucket_end = nullptr;
  // Along the sweep axis each box is at least as long as a bucket is wide: so of two of the strip
  // none ends before another begins that lies before it in the order.
  bool long_boxes = false;
  bool framed = false;  // `id`, `begins` and `asks` tell more than the records; see Frame and Kinds

  std::uint32_t bucket_of(int word) const noexcept {
    return (static_cast<std::uint32_t>(word) >> shift) - first_bucket;
  }
};

struct Sweep {
  const Strip* queries = nullptr;
  const Strip* targets = nullptr;
  const std::uint32_t* start = nullptr;  // the first target of each query; null: the one after it
  Orientation orientation = Orientation::unordered;
  std::uint32_t begin = 0, end = ~0u;  // of the queries: multiples of sweep_piece, or the last
};
constexpr std::uint32_t sweep_piece = 256;

// Boxes as floats, one array a coordinate, readable 16 beyond `count`. An inactive box is all NaN.
struct Tile {
  const float* corner[6];
  const std::uint32_t* id;
  std::uint32_t count;
};

// The seconds of the pairs of one first, and where the pairs go: the latter half of that place may
// be where the seconds are.
struct PairList {
  const std::uint32_t* seconds = nullptr;
  Pair* to = nullptr;
  std::uint32_t count = 0;
  std::uint32_t first = 0;
};
// Lists that are sorted side by side.
constexpr std::uint32_t sorted_lists = 16;

// Pairs as numbers of 32 bits: the last bits of first, then those of second. They are in order but
// for runs of at most `longest`, none of which has a key that belongs into another.
struct KeyRuns {
  std::uint32_t* keys;  // writable for run_padding beyond
  std::size_t count;
  std::uint32_t longest;
  std::uint32_t first_above;  // the other bits of first
  unsigned second_bits;       // below 32
};
constexpr std::size_t run_padding = 16;

// The filters of some boxes, side by side; absent ones hold what says nothing.
constexpr std::uint32_t filter_tile = 256;
struct FilterTile {
  const std::uint32_t *group, *mask;
  const std::uint8_t* is_static;
};
struct Combination {
  std::uint32_t group, mask;
  std::uint32_t is_static;  // 0 or 1
  bool operator==(const Combination&) const = default;
};
constexpr std::uint8_t unknown_kind = 0xff;

// Which worlds some boxes have. World -1, that of all, is the greatest number without a sign and
// the least with one, so that neither end is it while there is any other.
struct WorldRange {
  std::uint32_t least = 0xffffffffu;
  std::int32_t greatest = -1;
  std::uint64_t of_all = 0;  // boxes

  bool several() const noexcept { return static_cast<std::int32_t>(least) < greatest; }
  void add(const WorldRange& other) noexcept {
    least = other.least < least ? other.least : least;
    greatest = other.greatest > greatest ? other.greatest : greatest;
    of_all += other.of_all;
  }
};

struct Kernels {
  Isa isa;
  core::SweepCost sweep_cost;
  // Enters `count` <= bin_tile boxes, `stride` bytes apart, into the columns that they touch, and
  // lists those that it leaves to the caller: boxes that are none, those that touch three or more
  // columns along an axis, and in the plain form all that touch more than one. Reads on to the end
  // of the last bin_group, and a float beyond. ids null: first_id, first_id + 1, ...
  void (*bin)(const core::Quantiser&, const char* boxes, std::size_t stride,
              const std::uint32_t* ids, std::uint32_t first_id, std::uint32_t count, BinTarget&);
  // The least and greatest lower word of `axis` among records; taken into *least and *most.
  void (*word_range)(const Record*, std::uint32_t count, std::uint32_t axis, std::uint32_t* least,
                     std::uint32_t* most);
  // Fills a strip's arrays from its records.
  void (*transpose)(Strip&);
  void (*sweep)(const Sweep&, Emit&);
  // Which of the known combinations (below unknown_kind) each box of a tile has, the last where
  // several are alike, or unknown_kind; false where one has that.
  bool (*match_kinds)(const FilterTile&, const Combination* known, std::uint32_t known_count,
                      std::uint8_t* kinds);
  // Adds the worlds of `count` <= filter_tile boxes, readable as a whole tile of the same worlds.
  void (*read_worlds)(const std::int32_t* worlds, std::uint32_t count, WorldRange&);
  // Every box of `queries` against every box of `targets`; of one tile with itself each pair once.
  void (*all_pairs)(const Tile& queries, const Tile& targets, bool same, Orientation, Emit&);
  // Sorts each of `sorted_lists` lists by its seconds; the longest has `rows` pairs at most, a
  // multiple of 8, and `room` is for as many rows of a number a list. Null, as the next, where
  // vectors are too short for that to pay.
  void (*sort_lists)(const PairList* lists, std::uint32_t rows, std::uint32_t* room);
  // Sorts keys, and writes the pairs that they stand for.
  void (*sort_runs)(const KeyRuns&, Pair* to);
};

// The table of an instruction set, or null where this build or processor has it not.
// automatic: what THRONG_ISA names, else the widest.
const Kernels* find_kernels(Isa) noexcept;

extern const Kernels scalar_kernels;

// The widest sets that the compiler and this processor have; null where absent.
const Kernels* simd_kernels(Isa) noexcept;

}  // namespace throng::cpu
