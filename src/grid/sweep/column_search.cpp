// Builds the strips of each column and sweeps them.
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
#include <utility>

#include "grid/plan/refine_column.hpp"

namespace throng::grid {
namespace {

// Whether a set has far more boxes in a column than the other.
bool far_more(std::uint32_t most, std::uint32_t least) noexcept {
  return base::cost.set_ratio * least < most;
}

// Follows the last record, as records are transposed in groups. Of maximal extent, so that it does
// not count as the shortest box; its coordinates are then replaced by those of padding.
constexpr Record no_record{
    {{0, 0, 0}, {base::max_quantized, base::max_quantized, base::max_quantized}}, 0};

}  // namespace

// Building strips from a column's boxes: a counting sort along the sweep axis, then arrays.

ColumnSearch::ColumnBoxes ColumnSearch::collect(std::uint32_t column, unsigned side) {
  const std::uint32_t first = side == 0 ? 0 : static_cast<std::uint32_t>(scratch_.segment_count);
  std::uint32_t segments = first, records = 0;
  for (unsigned t = 0; t < grid_.task_count(); ++t) {
    const std::uintptr_t tail = grid_.tail(t, side, column);
    if (tail == 0) continue;
    // Each binning divides the boxes among tasks differently, so a column's blocks may vary by one
    // per task.
    scratch_.segments.grow(segments + grid_.block_count(tail) + grid_.task_count(), segments);
    grid_.each_segment(tail, [&](const Segment& segment) {
      scratch_.segments[segments++] = segment;
      records += segment.count;
    });
  }
  scratch_.segment_count = segments;
  return {first, segments - first, records};
}

// Reduces the larger side to the boxes near the smaller side's. The sweep axis is divided into
// stretches; two boxes that overlap share a coordinate, so a stretch. Keeps the order, and copies.
// Returns `many` as it is if a sample suggests that most boxes would stay.
ColumnSearch::ColumnBoxes ColumnSearch::thin_out(const ColumnBoxes& many, const ColumnBoxes& few) {
  constexpr unsigned stretch_bits = 6;
  constexpr std::uint32_t stretches = (base::max_quantized >> stretch_bits) + 1, max_sampled = 64;
  const std::uint32_t axis = plan_.sweep_axis;
  std::uint16_t reached_before[stretches + 1] = {};
  const auto first_of = [axis](const Record& r) { return r.lower[axis] >> stretch_bits; };
  const auto last_of = [axis](const Record& r) { return r.upper[axis] >> stretch_bits; };
  const auto near = [&](const Record& r) {
    return reached_before[last_of(r) + 1] != reached_before[first_of(r)];
  };
  for (const auto [records, count] : segments(few)) {
    for (const Record* r = records; r != records + count; ++r)
      std::fill(reached_before + first_of(*r) + 1, reached_before + last_of(*r) + 2, 1);
  }
  for (std::uint32_t k = 0; k < stretches; ++k)
    reached_before[k + 1] = static_cast<std::uint16_t>(reached_before[k + 1] + reached_before[k]);
  const Segment first = segments(many).back();
  const auto sampled = std::min(max_sampled, first.count);
  const auto sampled_near =
      static_cast<std::uint32_t>(std::count_if(first.records, first.records + sampled, near));
  if (sampled_near > sampled / 2) return many;

  Record* const kept = scratch_.near_records.ensure(many.records + 1);
  std::uint32_t count = 0, seen = 0;
  for (const Segment& segment : segments(many)) {
    for (const Record* r = segment.records; r != segment.records + segment.count; ++r) {
      if (seen++ % RecordPrefetcher::records_per_step == 0) ahead_.step();
      kept[count] = *r;
      count += near(*r);
    }
  }
  const auto at = static_cast<std::uint32_t>(scratch_.segment_count);
  scratch_.segments.grow(at + 1, at)[at] = {kept, count};
  scratch_.segment_count = at + 1;
  return {at, 1, count};
}

// The range of the boxes' lower coordinates.
ColumnSearch::Range ColumnSearch::quantized_range(std::span<const Part> parts) const {
  Range range{base::max_quantized, 0};
  for (const Part& part : parts) {
    for (const ColumnBoxes& raw : part.raw) {
      for (const Segment& segment : segments(raw)) {
        search_.kernels->quantized_range(segment.records, segment.count, plan_.sweep_axis,
                                         &range.least, &range.most);
      }
    }
  }
  return range;
}

// Chooses about as many buckets as the larger strip has boxes.
void ColumnSearch::set_buckets(Range quantized_range, std::uint32_t wanted, Strip& strip) const {
  std::uint32_t shift = 0;
  while ((quantized_range.most >> shift) - (quantized_range.least >> shift) >= wanted) ++shift;
  strip.shift = shift;
  strip.first_bucket = quantized_range.least >> shift;
  strip.bucket_count = (quantized_range.most >> shift) - (quantized_range.least >> shift) + 1;
}

// Calls f(record) for each of a segment. A column is read twice; each pass prefetches half of the
// lines of the next column, as the core has few outstanding prefetches.
template <class F>
void ColumnSearch::each_record(const Segment& segment, const F& f) {
  constexpr std::uint32_t a_step = 2 * RecordPrefetcher::records_per_step;
  const Record* r = segment.records;
  const Record* const last = r + segment.count;
  for (; last - r >= std::ptrdiff_t{a_step}; r += a_step) {
    ahead_.step();
    for (std::uint32_t k = 0; k < a_step; ++k) f(r[k]);
  }
  for (; r != last; ++r) f(*r);
}

// Counts the boxes per bucket; a box's rank is the number counted before it.
void ColumnSearch::count(Part& part) {
  const std::uint32_t axis = plan_.sweep_axis;
  const std::uint32_t shift = part.strip.shift, first_bucket = part.strip.first_bucket;
  std::uint32_t* const in = part.storage.buckets.ensure(part.strip.bucket_count + 1);
  std::uint32_t* rank = part.storage.ranks.ensure(part.strip.count);
  std::memset(in, 0, part.strip.bucket_count * sizeof *in);
  const auto prefetch_segment = [](const Segment& segment) {
    for (std::uint32_t k = 0; k < segment.count; k += 64 / sizeof(Record))
      base::prefetch_l2(segment.records + k);
  };
  for (const ColumnBoxes& raw : part.raw) {
    const std::span<const Segment> all = segments(raw);
    if (!all.empty()) prefetch_segment(all[0]);
    for (std::size_t s = 0; s < all.size(); ++s) {
      if (s + 1 < all.size()) prefetch_segment(all[s + 1]);
      each_record(all[s], [&](const Record& r) {
        *rank++ = in[(r.lower[axis] >> shift) - first_bucket]++;
      });
    }
  }
}

// Whether all boxes lie in at most half of the range of buckets.
bool ColumnSearch::clustered(std::span<const Part> parts) const {
  const auto taken = [&](std::uint32_t k) {
    return std::any_of(parts.begin(), parts.end(),
                       [k](const Part& part) { return part.storage.buckets.data()[k] != 0; });
  };
  const std::uint32_t bucket_count = parts.front().strip.bucket_count;
  std::uint32_t first = 0, end = bucket_count;
  while (first < end && !taken(first)) ++first;
  while (end > first && !taken(end - 1)) --end;
  return 2 * (end - first) <= bucket_count;
}

// Orders the boxes by bucket. Each destination depends on the rank alone, so no store waits for the
// one before it.
void ColumnSearch::arrange(Part& part) {
  Strip& strip = part.strip;
  const std::uint32_t axis = plan_.sweep_axis;
  const std::uint32_t shift = strip.shift, first_bucket = strip.first_bucket;
  const std::uint32_t bucket_count = strip.bucket_count;
  std::uint32_t* const start = part.storage.buckets.data();
  std::uint32_t sum = 0;
  for (std::uint32_t k = 0; k < bucket_count; ++k) sum += std::exchange(start[k], sum);
  start[bucket_count] = sum;
  strip.record = {part.storage.order, strip.count};
  const std::uint32_t* rank = part.storage.ranks.data();
  for (const ColumnBoxes& raw : part.raw) {
    for (const Segment& segment : segments(raw)) {
      each_record(segment, [&](const Record& record) {
        strip.record[start[(record.lower[axis] >> shift) - first_bucket] + *rank++] = &record;
      });
    }
  }
  strip.bucket_end = start + 1;
  strip.axis = axis;
  fill(strip, part.side, part.storage);
}

// Counting sort of all parts into the same buckets, over the full coordinate range. If the plan
// expects clustered boxes, or counting finds them clustered, over the range that they use.
void ColumnSearch::sort(std::span<Part> parts) {
  std::uint32_t wanted = 1;
  for (Part& part : parts) {
    for (const ColumnBoxes& raw : part.raw) part.strip.count += raw.records;
    wanted = std::max(wanted, part.strip.count);
  }
  constexpr Range all{0, base::max_quantized};
  for (Range range = plan_.clustered ? quantized_range(parts) : all;;
       range = quantized_range(parts)) {
    for (Part& part : parts) {
      set_buckets(range, wanted, part.strip);
      count(part);
    }
    if (plan_.clustered || range.most - range.least != base::max_quantized || !clustered(parts))
      break;
  }
  for (Part& part : parts) arrange(part);
}

// Fills a strip's arrays from its records. In a nested search maps labels to ids and adds the
// parent's reject bits; adds those of filter classes.
void ColumnSearch::fill(Strip& strip, unsigned side, StripStorage& storage) const {
  const FilterClasses* const filter_classes = classes_in_masks();
  storage.assign_storage(strip, filter_classes != nullptr);
  std::fill_n(strip.record.data() + strip.count, Strip::record_padding, &no_record);
  search_.kernels->transpose(strip);
  if (problem_.parent) {
    for (std::uint32_t i = 0; i < strip.count; ++i) {
      const std::uint32_t label = strip.id[i];
      strip.id[i] = problem_.parent->ids[label];
      strip.target_mask[i] = strip.target_mask[i] | problem_.parent->masks[label];
    }
  }
  const Strip s = strip;  // a local copy: the compiler must assume that the stores may change the
                          // original
  const std::uint32_t base = problem_.target_id_offset;
  if (mixed_) {
    for (std::uint32_t i = 0; i < s.count; ++i)
      s.target_mask[i] = s.target_mask[i] | RejectMask::of_set(s.id[i] >= base);
  }
  if (!filter_classes) return;
  const RejectMask* const as_query = filter_classes->as_query();
  const RejectMask* const as_target = filter_classes->as_target();
  const auto add_class_bits = [&](auto class_of_id) {
    for (std::uint32_t i = 0; i < s.count; ++i) {
      const std::uint32_t k = class_of_id(s.id[i]);
      const RejectMask mask = s.target_mask[i];
      s.query_mask[i] = mask | as_query[k];
      s.target_mask[i] = mask | as_target[k];
    }
  };
  if (base != 0) {
    add_class_bits([base, first = filter_classes->of(false), second = filter_classes->of(true)](
                       std::uint32_t id) { return id < base ? first[id] : second[id - base]; });
  } else {
    add_class_bits([filter_class = filter_classes->of(side == 1)](std::uint32_t id) {
      return filter_class[id];
    });
  }
}

// Sweeping them.

// In pieces, so that cancellation is noticed promptly in a column of very many boxes.
void ColumnSearch::sweep(SweepArgs args) {
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
  std::uint32_t* starts = scratch_.starts.ensure(from.count + Strip::padding);
  for (std::uint32_t i = 0; i < from.count; ++i) {
    const std::uint32_t bucket = from.bucket_of(from.lower[0][i]) + (skip_own_bucket ? 1 : 0);
    starts[i] = bucket == 0 ? 0 : to.bucket_end[bucket - 1];
  }
  sweep({&from, &to, starts, orientation});
}

// Compares the wide boxes of a subset that touch this column with all its targets.
void ColumnSearch::sweep_wide(std::uint32_t column, unsigned side, const Strip& targets,
                              Orientation orientation) {
  const std::span<const WideBox> wide = grid_.wide(side);
  if (wide.empty() || targets.count == 0) return;
  worker_.visited += wide.size();
  const base::Quantizer& map = plan_.map;
  const std::uint32_t here = column % map.column_count(), place = column - here;
  const std::int32_t at[3] = {static_cast<std::int32_t>(here / map.stride[0]),
                              static_cast<std::int32_t>(here / map.stride[1] % map.columns[1]),
                              static_cast<std::int32_t>(here % map.columns[2])};
  Record* clipped = scratch_.clipped.ensure(wide.size());
  Strip strip;
  strip.record = {scratch_.wide_strip.order, wide.size()};
  for (const WideBox& s : wide) {
    bool touches = s.column_offset == place || s.column_offset == needs_slow_path;
    for (int k = 0; k < 3; ++k) {
      touches &= base::column_of(s.lower[k]) <= at[k] && at[k] <= base::column_of(s.upper[k]);
    }
    if (!touches) continue;
    Record& r = clipped[strip.count];
    strip.record[strip.count++] = &r;
    for (int k = 0; k < 3; ++k) {
      r.lower[k] = base::quantized_lower(s.lower[k], at[k]);
      r.upper[k] = base::quantized_upper(s.upper[k], at[k]);
    }
    r.id = s.id;
  }
  if (strip.count == 0) return;
  strip.axis = plan_.sweep_axis;
  fill(strip, side, scratch_.wide_strip);
  std::uint32_t* starts = scratch_.starts.ensure(strip.count + Strip::padding);
  std::memset(starts, 0, strip.count * sizeof *starts);
  sweep({&strip, &targets, starts, orientation});
}

// Two sets as one strip: boxes of one set share a reject bit and are not reported, but they are
// compared with each other, too. So one set must not have far more boxes, nor windows be long.
// Returns false, with no pair reported, if the sets are to be compared strip against strip.
bool ColumnSearch::sweep_mixed(std::uint32_t column, std::span<const ColumnBoxes> sides) {
  const auto [least, most] = std::minmax(sides[0].records, sides[1].records);
  // Without vectors, comparisons within a set cost more than they save.
  if (far_more(most, least) || plan_.window > base::cost.set_window ||
      search_.kernels->isa == Isa::scalar)
    return false;
  mixed_ = true;
  Part part{sides, 0, scratch_.query_strip};
  sort({&part, 1});
  const Strip& all = part.strip;
  sweep({&all, &all, nullptr, forward()});
  for (unsigned side = 0; side < 2; ++side) sweep_wide(column, side, all, forward());
  mixed_ = false;
  return true;
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
  const bool any_query = queries || !grid_.wide(0).empty();
  const bool any_target = targets || !grid_.wide(1).empty();
  if (!(problem_.self && queries) && !(queries && any_target) && !(any_query && targets)) return;
  if (problem_.target_id_offset != 0 && sweep_mixed(column, sides)) return;
  for (unsigned few = 0; few < 2 && !problem_.self; ++few) {
    // A wide box of the smaller set may overlap any.
    ColumnBoxes &one = sides[few], &other = sides[1 - few];
    if (grid_.wide(few).empty() && far_more(other.records, one.records)) {
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
