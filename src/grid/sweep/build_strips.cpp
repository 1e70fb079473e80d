// Builds strips from a column's boxes: a counting sort along the sweep axis, then arrays.
#include <algorithm>
#include <cstring>
#include <utility>

#include "grid/sweep/column_search.hpp"

namespace throng::grid {
namespace {

// Follows the last record; of maximal extent on each axis.
constexpr Record no_record{
    {0, 0, 0}, {base::max_quantized, base::max_quantized, base::max_quantized}, 0};

}  // namespace

ColumnSearch::ColumnBoxes ColumnSearch::collect(std::uint32_t column, unsigned side) {
  const std::uint32_t first = side == 0 ? 0 : static_cast<std::uint32_t>(scratch_.segment_count);
  std::uint32_t segments = first, records = 0;
  for (unsigned t = 0; t < grid_.tasks_; ++t) {
    const std::uintptr_t tail = grid_.tails(t, side)[column];
    if (tail == 0) continue;
    const auto* block = reinterpret_cast<const BinnedGrid::Block*>(grid_.block_of(tail));
    const std::size_t blocks = block->before / (grid_.block_bytes_ / sizeof(Record) - 1) + 1;
    // Each binning divides the boxes among tasks differently, so a column's blocks may vary by one
    // per task.
    scratch_.segments.grow(segments + blocks + grid_.tasks_, segments);
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
  if (std::count_if(first.records, first.records + sampled, near) > sampled / 2) return many;

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
  for (; last - r >= a_step; r += a_step) {
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
      prefetch_l2(segment.records + k);
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
  const Record** const order = part.storage.order.ensure(strip.count + record_padding);
  const std::uint32_t* rank = part.storage.ranks.data();
  for (const ColumnBoxes& raw : part.raw) {
    for (const Segment& segment : segments(raw)) {
      each_record(segment, [&](const Record& record) {
        order[start[(record.lower[axis] >> shift) - first_bucket] + *rank++] = &record;
      });
    }
  }
  strip.bucket_end = start + 1;
  strip.record = order;
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
  std::fill_n(storage.order.data() + strip.count, record_padding, &no_record);
  search_.kernels->transpose(strip);
  strip.has_overrides = problem_.parent || filter_classes || mixed_;
  if (problem_.parent) {
    for (std::uint32_t i = 0; i < strip.count; ++i) {
      const std::uint32_t label = strip.id[i];
      strip.id[i] = problem_.parent->ids[label];
      strip.target_reject_bits[i] = static_cast<std::int16_t>(strip.target_reject_bits[i] |
                                                              problem_.parent->reject_bits[label]);
    }
  }
  const Strip s = strip;  // a local copy: the compiler must assume that the stores may change the
                          // original
  const std::uint32_t base = problem_.target_id_offset;
  if (mixed_) {
    for (std::uint32_t i = 0; i < s.count; ++i)
      s.target_reject_bits[i] = static_cast<std::int16_t>(s.target_reject_bits[i] |
                                                          (s.id[i] < base ? 1 : 2) << subset_bit);
  }
  if (!filter_classes) return;
  const std::uint16_t* const as_query = filter_classes->as_query();
  const std::uint16_t* const as_target = filter_classes->as_target();
  const auto add_class_bits = [&](auto class_of_id) {
    for (std::uint32_t i = 0; i < s.count; ++i) {
      const std::uint32_t k = class_of_id(s.id[i]),
                          target_reject_bits = static_cast<std::uint16_t>(s.target_reject_bits[i]);
      s.query_reject_bits[i] = static_cast<std::int16_t>(target_reject_bits | as_query[k]);
      s.target_reject_bits[i] = static_cast<std::int16_t>(target_reject_bits | as_target[k]);
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

}  // namespace throng::grid
