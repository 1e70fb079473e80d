// Sweeps the strips of each column.
//
// Every two boxes of a column whose quantized ranges overlap are compared once. In a strip, i
// before j: bucket(i) <= bucket(j), so if they overlap, bucket(lower j) <= bucket(upper i), and the
// window of i, which lasts while that holds, includes j; the window of j begins after j. Of two
// strips, the box of the lower bucket searches, and of equal buckets the query (sweep_against()). A
// wide box is compared with all of a strip that begins before it ends, in each column that it
// touches; the owner-cell rule selects one. Two wide boxes share no column and are compared by
// brute force. Worlds with columns of their own share none. A box in every world is wide in each
// world's columns, and any other box has columns of one world only, so that the two have one owner
// cell.
//
// Two sets may share a strip, whose boxes are compared like those of one set. Boxes of the same set
// have a reject bit in common, as have boxes with another owner cell, and their pairs are not
// reported. If one set has few boxes in a column, boxes of the other that are far from all of these
// are left out (thin_out()).
#include "grid/sweep/column_search.hpp"

#include <algorithm>
#include <cstring>

#include "grid/plan/refine_column.hpp"

namespace throng::grid {
namespace {

// A strip of two sets is used unless one set has far more boxes or windows are long: boxes of one
// set are compared with each other too.
constexpr std::uint32_t max_set_ratio = 32;
constexpr double max_mixed_window = 64;
constexpr std::uint64_t max_mixed_boxes = 65536;  // boxes; space is reserved twice
constexpr std::uint32_t max_skipped = 31;         // columns skipped after failures

// The mean window length, from samples: for boxes in a row, the distance from the first box to the
// end of the last window.
double mean_window(const Strip& strip) {
  constexpr std::uint32_t samples = 32, in_a_row = 16;
  const std::uint32_t step = std::max(in_a_row, strip.count / samples);
  double sum = 0, count = 0;
  for (std::uint32_t i = 0; i < strip.count; i += step, ++count) {
    const std::int16_t* const upper = strip.upper[0] + i;
    const std::int16_t most = *std::max_element(upper, upper + std::min(in_a_row, strip.count - i));
    sum += strip.bucket_end[std::min(strip.bucket_of(most), strip.bucket_count - 1)] - i;
  }
  return sum / count;
}

}  // namespace

// In pieces, so that cancellation is noticed promptly in a column of very many boxes.
void ColumnSearch::sweep(Sweep args) {
  constexpr std::uint32_t comparisons = 1u << 26;
  const std::uint32_t pieces = comparisons / (args.targets->count + 1) / sweep_piece;
  const std::uint32_t step = std::max(pieces, 1u) * sweep_piece;
  const std::uint32_t count = args.queries->count;
  for (std::uint32_t begin = 0;;) {
    args.begin = begin;
    args.end = count - begin > step ? begin + step : count;
    search_.kernels->sweep(args, worker_);
    begin = args.end;
    if (begin == count || search_.over()) return;
  }
}

// Compares each query with the targets of its own bucket (or the next, if the opposite call covered
// its own) and later. So of two boxes of different subsets the one of the lower bucket searches,
// and of two in one bucket the query of the first call.
void ColumnSearch::sweep_against(const Strip& from, const Strip& to, bool skip_own_bucket,
                                 Orientation orientation) {
  std::uint32_t* starts = scratch_.starts.ensure(from.count + strip_padding);
  for (std::uint32_t i = 0; i < from.count; ++i) {
    const std::uint32_t bucket = from.bucket_of(from.lower[0][i]) + (skip_own_bucket ? 1 : 0);
    starts[i] = bucket == 0 ? 0 : to.bucket_end[bucket - 1];
  }
  sweep({&from, &to, starts, orientation});
}

// Compares the wide boxes of a subset that touch this column with all its targets.
void ColumnSearch::sweep_wide(std::uint32_t column, unsigned side, const Strip& targets,
                              Orientation orientation) {
  const std::uint32_t wide_count = grid_.wide_count_[side];
  if (wide_count == 0 || targets.count == 0) return;
  worker_.visited += wide_count;
  const base::Quantizer& map = plan_.map;
  const std::uint32_t here = column % map.column_count(), place = column - here;
  const std::int32_t at[3] = {static_cast<std::int32_t>(here / map.stride[0]),
                              static_cast<std::int32_t>(here / map.stride[1] % map.columns[1]),
                              static_cast<std::int32_t>(here % map.columns[2])};
  Record* clipped = scratch_.clipped.ensure(wide_count);
  const Record** order = scratch_.wide_strip.order.ensure(wide_count + record_padding);
  Strip strip;
  for (std::uint32_t i = 0; i < wide_count; ++i) {
    const Spanning& s = grid_.wide_[side][i];
    bool touches = s.column_offset == place || s.column_offset == needs_slow_path;
    for (int k = 0; k < 3; ++k) {
      touches &= base::column_of(s.lower[k]) <= at[k] && at[k] <= base::column_of(s.upper[k]);
    }
    if (!touches) continue;
    Record& r = clipped[strip.count];
    order[strip.count++] = &r;
    for (int k = 0; k < 3; ++k) {
      r.lower[k] = base::quantized_lower(s.lower[k], at[k]);
      r.upper[k] = base::quantized_upper(s.upper[k], at[k]);
    }
    r.id = s.id;
  }
  if (strip.count == 0) return;
  strip.record = order;
  strip.axis = plan_.sweep_axis;
  fill(strip, side, scratch_.wide_strip);
  std::uint32_t* starts = scratch_.starts.ensure(strip.count + strip_padding);
  std::memset(starts, 0, strip.count * sizeof *starts);
  sweep({&strip, &targets, starts, orientation});
}

// Two sets as one strip: boxes of one set share a reject bit and are not reported. Returns false,
// with no pair reported, if the sets are to be compared strip against strip.
bool ColumnSearch::sweep_mixed(std::uint32_t column, std::span<const ColumnBoxes> sides) {
  const auto [least, most] = std::minmax(sides[0].records, sides[1].records);
  // Without vectors, comparisons within a set cost more than they save.
  if (least < most / max_set_ratio || search_.kernels->isa == Isa::scalar) return false;
  if (skipped_ < skip_limit_) {
    ++skipped_;
    return false;
  }
  mixed_ = true;
  Part part{sides, 0, scratch_.query_strip};
  sort({&part, 1});
  const Strip& all = part.strip;
  const bool pays = mean_window(all) <= max_mixed_window;
  if (pays) {
    sweep({&all, &all, nullptr, forward()});
    for (unsigned side = 0; side < 2; ++side) sweep_wide(column, side, all, forward());
  }
  mixed_ = false;
  skip_limit_ = pays ? 0 : std::min(2 * skip_limit_ + 1, max_skipped);
  skipped_ = 0;
  return pays;
}

void ColumnSearch::run(std::uint32_t column, std::uint32_t next) {
  scratch_.segment_count = 0;
  ahead_.start(grid_, next);
  const bool has_targets = problem_.targets.count != 0;
  ColumnBoxes sides[2] = {collect(column, 0),
                          has_targets ? collect(column, 1) : ColumnBoxes{0, 0, 0}};
  worker_.visited += std::uint64_t{sides[0].records} + sides[1].records;
  // Skips columns without a possible pair: often only one set is present. Wide boxes are in no
  // column.
  const bool queries = sides[0].records != 0, targets = sides[1].records != 0;
  const bool any_query = queries || grid_.wide_count_[0] != 0;
  const bool any_target = targets || grid_.wide_count_[1] != 0;
  if (!(problem_.self && queries) && !(queries && any_target) && !(any_query && targets)) return;
  const std::uint64_t both = std::uint64_t{sides[0].records} + sides[1].records;
  if (problem_.target_id_offset != 0 && both <= max_mixed_boxes) {
    // The method for a column depends on earlier columns: reserve space for either.
    for (StripStorage* space : {&scratch_.query_strip, &scratch_.target_strip})
      space->reserve(static_cast<std::uint32_t>(both), classes_in_masks() != nullptr);
    scratch_.starts.ensure(both + strip_padding);
    if (sweep_mixed(column, sides)) return;
  }
  for (unsigned few = 0; few < 2 && !problem_.self; ++few) {
    // A wide box of the smaller set may overlap any.
    ColumnBoxes &one = sides[few], &other = sides[1 - few];
    if (grid_.wide_count_[few] == 0 && one.records < other.records / max_set_ratio) {
      other = thin_out(other, one);
      break;  // stop here: there is space to thin out one set only
    }
  }
  Part parts[2] = {{{sides, 1}, 0, scratch_.query_strip},
                   {{sides + 1, 1}, 1, scratch_.target_strip}};
  sort({parts, has_targets ? 2u : 1u});
  const Strip &a = parts[0].strip, &b = parts[1].strip;
  if (!refine(search_, problem_, worker_, a, b, depth_)) {
    if (problem_.self) sweep({&a, &a, nullptr, forward()});
    if (has_targets && a.count && b.count) {
      sweep_against(a, b, false, forward());
      sweep_against(b, a, true, backward());
    }
  }
  if (problem_.self) sweep_wide(column, 0, a, forward());
  if (has_targets) {
    sweep_wide(column, 0, b, forward());
    sweep_wide(column, 1, a, backward());
  }
}

}  // namespace throng::grid
