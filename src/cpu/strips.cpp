// Builds strips from a column's boxes: a counting sort along the sweep axis, then arrays.
#include <algorithm>
#include <cstring>
#include <utility>

#include "cpu/column.hpp"

namespace throng::cpu {
namespace {

// Follows the last record; of maximal extent on each axis.
constexpr Record no_record{{0, 0, 0}, {core::top_word, core::top_word, core::top_word}, 0};

}  // namespace

ColumnSearch::Raw ColumnSearch::collect(std::uint32_t column, unsigned side) {
  const std::uint32_t first = side == 0 ? 0 : static_cast<std::uint32_t>(level_.segment_count);
  std::uint32_t segments = first, records = 0;
  for (unsigned t = 0; t < space_.tasks_; ++t) {
    const std::uintptr_t tail = space_.tails(t, side)[column];
    if (tail == 0) continue;
    const auto* block = reinterpret_cast<const GridSpace::Block*>(space_.block_of(tail));
    const std::size_t blocks = block->before / (space_.block_bytes_ / sizeof(Record) - 1) + 1;
    // Each binning divides the boxes among tasks differently, so a column's blocks may vary by one
    // per task.
    level_.segments.grow(segments + blocks + space_.tasks_, segments);
    space_.each_segment(tail, [&](const Segment& segment) {
      level_.segments[segments++] = segment;
      records += segment.count;
    });
  }
  level_.segment_count = segments;
  return {first, segments - first, records};
}

// Reduces the larger side to the boxes near the smaller side's. The sweep axis is divided into
// stretches; two boxes that overlap share a coordinate, so a stretch. Keeps the order, and copies.
// Returns `many` as it is if a sample suggests that most boxes would stay.
ColumnSearch::Raw ColumnSearch::thin_out(const Raw& many, const Raw& few) {
  constexpr unsigned stretch_bits = 6;
  constexpr std::uint32_t stretches = (core::top_word >> stretch_bits) + 1, told_by = 64;
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
  const auto told = std::min(told_by, first.count);
  if (std::count_if(first.records, first.records + told, near) > told / 2) return many;

  Record* const kept = level_.near_few.room(many.records + 1);
  std::uint32_t count = 0, seen = 0;
  for (const Segment& segment : segments(many)) {
    for (const Record* r = segment.records; r != segment.records + segment.count; ++r) {
      if (seen++ % LookAhead::records_a_step == 0) ahead_.step();
      kept[count] = *r;
      count += near(*r);
    }
  }
  const auto at = static_cast<std::uint32_t>(level_.segment_count);
  level_.segments.grow(at + 1, at)[at] = {kept, count};
  level_.segment_count = at + 1;
  return {at, 1, count};
}

// The range of the boxes' lower coordinates.
ColumnSearch::Range ColumnSearch::words(std::span<const Part> parts) const {
  Range range{core::top_word, 0};
  for (const Part& part : parts) {
    for (const Raw& raw : part.raw) {
      for (const Segment& segment : segments(raw)) {
        search_.kernels->word_range(segment.records, segment.count, plan_.sweep_axis, &range.least,
                                    &range.most);
      }
    }
  }
  return range;
}

// Chooses about as many buckets as the larger strip has boxes.
void ColumnSearch::set_buckets(Range words, std::uint32_t wanted, Strip& strip) const {
  std::uint32_t shift = 0;
  while ((words.most >> shift) - (words.least >> shift) >= wanted) ++shift;
  strip.shift = shift;
  strip.first_bucket = words.least >> shift;
  strip.bucket_count = (words.most >> shift) - (words.least >> shift) + 1;
}

// Calls f(record) for each of a segment. A column is read twice; each pass prefetches half of the
// lines of the next column, as the core has few outstanding prefetches.
template <class F>
void ColumnSearch::each_record(const Segment& segment, const F& f) {
  constexpr std::uint32_t a_step = 2 * LookAhead::records_a_step;
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
  std::uint32_t* const in = part.room.buckets.room(part.strip.bucket_count + 1);
  std::uint32_t* rank = part.room.ranks.room(part.strip.count);
  std::memset(in, 0, part.strip.bucket_count * sizeof *in);
  const auto ask = [](const Segment& segment) {
    for (std::uint32_t k = 0; k < segment.count; k += 64 / sizeof(Record))
      prefetch_to_read(segment.records + k);
  };
  for (const Raw& raw : part.raw) {
    const std::span<const Segment> all = segments(raw);
    if (!all.empty()) ask(all[0]);
    for (std::size_t s = 0; s < all.size(); ++s) {
      if (s + 1 < all.size()) ask(all[s + 1]);
      each_record(all[s], [&](const Record& r) {
        *rank++ = in[(r.lower[axis] >> shift) - first_bucket]++;
      });
    }
  }
}

// Whether all boxes lie in at most half of the range of buckets.
bool ColumnSearch::crowded(std::span<const Part> parts) const {
  const auto taken = [&](std::uint32_t k) {
    return std::any_of(parts.begin(), parts.end(),
                       [k](const Part& part) { return part.room.buckets.data()[k] != 0; });
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
  std::uint32_t* const start = part.room.buckets.data();
  std::uint32_t sum = 0;
  for (std::uint32_t k = 0; k < bucket_count; ++k) sum += std::exchange(start[k], sum);
  start[bucket_count] = sum;
  const Record** const order = part.room.order.room(strip.count + record_padding);
  const std::uint32_t* rank = part.room.ranks.data();
  for (const Raw& raw : part.raw) {
    for (const Segment& segment : segments(raw)) {
      each_record(segment, [&](const Record& record) {
        order[start[(record.lower[axis] >> shift) - first_bucket] + *rank++] = &record;
      });
    }
  }
  strip.bucket_end = start + 1;
  strip.record = order;
  strip.axis = axis;
  fill(strip, part.side, part.room);
}

// Counting sort of all parts into the same buckets, over the full coordinate range. If the plan
// expects clustered boxes, or counting finds them clustered, over the range that they use.
void ColumnSearch::sort(std::span<Part> parts) {
  std::uint32_t wanted = 1;
  for (Part& part : parts) {
    for (const Raw& raw : part.raw) part.strip.count += raw.records;
    wanted = std::max(wanted, part.strip.count);
  }
  constexpr Range all{0, core::top_word};
  for (Range range = plan_.crowded ? words(parts) : all;; range = words(parts)) {
    for (Part& part : parts) {
      set_buckets(range, wanted, part.strip);
      count(part);
    }
    if (plan_.crowded || range.most - range.least != core::top_word || !crowded(parts)) break;
  }
  for (Part& part : parts) arrange(part);
}

// Fills a strip's arrays from its records. In a nested search maps labels to ids and adds the
// parent's reject bits; adds those of filter classes.
void ColumnSearch::fill(Strip& strip, unsigned side, StripSpace& room) const {
  const Kinds* const kinds = words_of_kinds();
  room.lay_out(strip, kinds != nullptr);
  std::fill_n(room.order.data() + strip.count, record_padding, &no_record);
  search_.kernels->transpose(strip);
  strip.framed = problem_.frame || kinds || mixed_;
  if (problem_.frame) {
    for (std::uint32_t i = 0; i < strip.count; ++i) {
      const std::uint32_t label = strip.id[i];
      strip.id[i] = problem_.frame->ids[label];
      strip.begins[i] = static_cast<std::int16_t>(strip.begins[i] | problem_.frame->before[label]);
    }
  }
  const Strip s = strip;  // a local copy: the compiler must assume that the stores may change the
                          // original
  const std::uint32_t base = problem_.raised_by;
  if (mixed_) {
    for (std::uint32_t i = 0; i < s.count; ++i)
      s.begins[i] = static_cast<std::int16_t>(s.begins[i] | (s.id[i] < base ? 1 : 2) << side_bit);
  }
  if (!kinds) return;
  const std::uint16_t* const as_query = kinds->as_query();
  const std::uint16_t* const as_target = kinds->as_target();
  const auto add_kinds = [&](auto kind_of) {
    for (std::uint32_t i = 0; i < s.count; ++i) {
      const std::uint32_t k = kind_of(s.id[i]), begins = static_cast<std::uint16_t>(s.begins[i]);
      s.asks[i] = static_cast<std::int16_t>(begins | as_query[k]);
      s.begins[i] = static_cast<std::int16_t>(begins | as_target[k]);
    }
  };
  if (base != 0) {
    add_kinds([base, first = kinds->of(false), second = kinds->of(true)](std::uint32_t id) {
      return id < base ? first[id] : second[id - base];
    });
  } else {
    add_kinds([kind = kinds->of(side == 1)](std::uint32_t id) { return kind[id]; });
  }
}

}  // namespace throng::cpu
