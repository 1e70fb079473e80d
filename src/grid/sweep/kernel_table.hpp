// The inner loops: one table of functions per instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

#include "base/cost_table.hpp"
#include "base/quantize.hpp"
#include "grid/bin/record_output.hpp"
#include "grid/emit/pair_output.hpp"
#include "grid/sweep/strip.hpp"

namespace throng::grid {

// Boxes as floats, one array per coordinate. Inactive boxes are all NaN.
struct Tile {
  base::PaddedArray<const float, 16> corner[6];
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
  static constexpr std::uint32_t padding = 16;
  base::PaddedArray<std::uint32_t, padding> keys;
  std::size_t count;
  std::uint32_t longest;
  std::uint32_t first_above;  // the remaining high bits of first
  unsigned second_bits;       // below 32
};

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
  const base::SweepCost* sweep_cost;  // of base::cost
  // Bins boxes: appends one record per column that a box touches. Lists the boxes that it leaves to
  // the caller: invalid boxes, and those that touch three or more columns on an axis; the scalar
  // kernel leaves all that touch more than one. Reads to the end of the last bin_group, plus one
  // float.
  void (*bin)(const base::Quantizer&, const BinInput&, RecordOutput&);
  // Merges the least and greatest lower coordinate on `axis` into *least and *most.
  void (*quantized_range)(const Record*, std::uint32_t count, std::uint32_t axis,
                          std::uint32_t* least, std::uint32_t* most);
  // Fills a strip's arrays from its records.
  void (*transpose)(Strip&);
  void (*sweep)(const SweepArgs&, PairOutput&);
  // Sets filter_classes[i] to the index of the known combination (below unknown_class) that box i
  // has, the last if several are equal; else to unknown_class. Returns false if any box is unknown.
  bool (*match_filter_classes)(const FilterTile&, const FilterCombination* known,
                               std::uint32_t known_count, std::uint8_t* filter_classes);
  // Merges the worlds of `count` <= filter_tile boxes. All filter_tile values must be readable and
  // taken from these boxes.
  void (*read_worlds)(const std::int32_t* worlds, std::uint32_t count, WorldRange&);
  // Tests every query against every target; within one tile each pair once.
  void (*all_pairs)(const Tile& queries, const Tile& targets, bool same, Orientation, PairOutput&);
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
