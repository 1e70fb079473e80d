// Finding: each column's boxes sorted along the sweep axis, then swept.
//
// Every two boxes of a column whose words overlap are compared once. In a strip, i before j:
// bucket(i) <= bucket(j), so if they overlap, bucket(lower j) <= bucket(upper i), and the window of
// i, which goes on while that holds, includes j; j's own window begins after j. Of two strips the
// box of the lower bucket asks, and of equal buckets the query (cross()). A wide box asks all of a
// strip that begins before it ends, in each column that it touches, where the home rule picks one;
// two wide boxes meet in no column and are compared by brute force. Worlds that have columns of
// their own share none. A box of all worlds is wide in each of them, and of those columns another
// box has the ones of its own world, so that the two have one home, too.
#include <algorithm>
#include <cstring>

#include "cpu/all_pairs.hpp"
#include "cpu/foretell.hpp"
#include "cpu/grid.hpp"
#include "cpu/kinds.hpp"
#include "cpu/look_ahead.hpp"
#include "cpu/refine.hpp"
#include "cpu/threads.hpp"

namespace throng::cpu {

std::uint32_t GridSpace::chain(std::uintptr_t tail, Segment* out) const noexcept {
  std::uint32_t count = 0;
  std::uintptr_t block = block_of(tail);
  std::uintptr_t end = tail;
  while (block) {
    const std::uintptr_t first = block + sizeof(Block);
    out[count++] = {reinterpret_cast<const Record*>(first),
                    static_cast<std::uint32_t>((end - first) / sizeof(Record))};
    block = reinterpret_cast<const Block*>(block)->previous;
    end = block + block_bytes_;
  }
  return count;
}

// Counts of a column fit 32 bits: a side's box is entered into a column once at most, so a side has
// max_box_count records there at most, and what is read beyond them, too, has a number. Of both
// sides together that need not be so: nothing here adds them up in 32 bits.
static_assert(max_box_count + strip_padding + 63 <= 0xffffffffu);

// What follows the last record: as long as can be along each axis.
constexpr Record no_record{{0, 0, 0}, {core::top_word, core::top_word, core::top_word}, 0};

// One worker's way through columns.
class ColumnSearch {
 public:
  ColumnSearch(Search& search, const Problem& problem, const core::GridPlan& plan, GridSpace& space,
               Worker& worker, unsigned depth)
      : search_(search),
        problem_(problem),
        plan_(plan),
        space_(space),
        worker_(worker),
        level_(worker.level(depth)),
        depth_(depth) {}

  // `next`: which will be run after it, or LookAhead::no_column.
  void run(std::uint32_t column, std::uint32_t next);

 private:
  // A column's boxes of one side, as they lie.
  struct Raw {
    std::uint32_t first_segment, segment_count, records;
  };
  Raw collect(std::uint32_t column, unsigned side);
  struct Range {
    std::uint32_t least, most;
  };
  Range words(const Raw& a, const Raw& b) const;
  void set_buckets(Range words, std::uint32_t wanted, Strip& strip) const;
  std::uint32_t* count(const Raw& raw, StripSpace& room, const Strip& strip) const;
  bool crowded(const Strip& a, const std::uint32_t* in_a, const std::uint32_t* in_b) const;
  void arrange(const Raw& raw, unsigned side, std::uint32_t* start, StripSpace& room, Strip& strip);
  void fill(Strip& strip, unsigned side, StripSpace& room) const;
  void cross(const Strip& from, const Strip& to, bool skip_own_bucket, Orientation orientation);
  void sweep_wide(std::uint32_t column, unsigned side, const Strip& targets, Orientation);

  Search& search_;
  const Problem& problem_;
  const core::GridPlan& plan_;
  GridSpace& space_;
  Worker& worker_;
  Level& level_;
  unsigned depth_;
  LookAhead ahead_;
};

ColumnSearch::Raw ColumnSearch::collect(std::uint32_t column, unsigned side) {
  const std::uint32_t first = side == 0 ? 0 : static_cast<std::uint32_t>(level_.segment_count);
  std::uint32_t segments = first, records = 0;
  for (unsigned t = 0; t < space_.tasks_; ++t) {
    const std::uintptr_t tail = space_.tails(t, side)[column];
    if (tail == 0) continue;
    const auto* block = reinterpret_cast<const GridSpace::Block*>(space_.block_of(tail));
    const std::size_t blocks = block->before / (space_.block_bytes_ / sizeof(Record) - 1) + 1;
    // Tasks share the boxes out anew each time, and leave a column up to a block each more or less.
    level_.segments.grow(segments + blocks + space_.tasks_, segments);
    const std::uint32_t added = space_.chain(tail, level_.segments.data() + segments);
    for (std::uint32_t i = 0; i < added; ++i) records += level_.segments[segments + i].count;
    segments += added;
  }
  level_.segment_count = segments;
  return {first, segments - first, records};
}

// The words at which boxes of the column begin.
ColumnSearch::Range ColumnSearch::words(const Raw& a, const Raw& b) const {
  Range range{core::top_word, 0};
  for (const Raw& raw : {a, b}) {
    for (std::uint32_t s = 0; s < raw.segment_count; ++s) {
      const Segment& segment = level_.segments[raw.first_segment + s];
      search_.kernels->word_range(segment.records, segment.count, plan_.sweep_axis, &range.least,
                                  &range.most);
    }
  }
  return range;
}

// About one or two boxes a bucket, were they spread evenly.
void ColumnSearch::set_buckets(Range words, std::uint32_t wanted, Strip& strip) const {
  std::uint32_t shift = 0;
  while ((words.most >> shift) - (words.least >> shift) >= wanted) ++shift;
  strip.shift = shift;
  strip.first_bucket = words.least >> shift;
  strip.bucket_count = (words.most >> shift) - (words.least >> shift) + 1;
}

// How many boxes begin in each bucket.
std::uint32_t* ColumnSearch::count(const Raw& raw, StripSpace& room, const Strip& strip) const {
  const std::uint32_t axis = plan_.sweep_axis;
  const std::uint32_t shift = strip.shift, first_bucket = strip.first_bucket;
  std::uint32_t* in = room.buckets.room(strip.bucket_count + 1);
  std::uint32_t* rank = room.ranks.room(raw.records);
  std::memset(in, 0, strip.bucket_count * sizeof *in);
  const Segment* segments = level_.segments.data() + raw.first_segment;
  const auto ask = [](const Segment& segment) {
    for (std::uint32_t k = 0; k < segment.count; k += 64 / sizeof(Record))
      prefetch_to_read(segment.records + k);
  };
  if (raw.segment_count != 0) ask(segments[0]);
  for (std::uint32_t s = 0; s < raw.segment_count; ++s) {
    if (s + 1 < raw.segment_count) ask(segments[s + 1]);
    const Record* r = segments[s].records;
    const Record* const last = r + segments[s].count;
    for (; r != last; ++r) *rank++ = in[(r->lower[axis] >> shift) - first_bucket]++;
  }
  return in;
}

// Whether half of the buckets or more lie before or behind all boxes.
bool ColumnSearch::crowded(const Strip& a, const std::uint32_t* in_a,
                           const std::uint32_t* in_b) const {
  const auto taken = [&](std::uint32_t k) { return (in_a[k] | (in_b ? in_b[k] : 0)) != 0; };
  std::uint32_t first = 0, end = a.bucket_count;
  while (first < end && !taken(first)) ++first;
  while (end > first && !taken(end - 1)) --end;
  return 2 * (end - first) <= a.bucket_count;
}

// A counting sort by bucket; `end` holds the counts.
void ColumnSearch::arrange(const Raw& raw, unsigned side, std::uint32_t* start, StripSpace& room,
                           Strip& strip) {
  const std::uint32_t axis = plan_.sweep_axis;
  const std::uint32_t shift = strip.shift, first_bucket = strip.first_bucket;
  const Segment* segments = level_.segments.data() + raw.first_segment;
  const std::uint32_t bucket_count = strip.bucket_count;
  std::uint32_t sum = 0;
  for (std::uint32_t k = 0; k < bucket_count; ++k) {
    const std::uint32_t count = start[k];
    start[k] = sum;
    sum += count;
  }
  start[bucket_count] = sum;
  const Record** order = room.order.room(strip.count + record_padding);
  const std::uint32_t* rank = room.ranks.data();
  for (std::uint32_t s = 0; s < raw.segment_count; ++s) {
    const Record* r = segments[s].records;
    const Record* const last = r + segments[s].count;
    const auto place = [&](const Record& record) {
      order[start[(record.lower[axis] >> shift) - first_bucket] + *rank++] = &record;
    };
    for (; last - r >= LookAhead::records_a_step; r += LookAhead::records_a_step) {
      ahead_.step();
      for (std::uint32_t k = 0; k < LookAhead::records_a_step; ++k) place(r[k]);
    }
    for (; r != last; ++r) place(*r);
  }
  strip.bucket_end = start + 1;
  strip.record = order;
  strip.axis = axis;
  fill(strip, side, room);
}

// A strip's arrays from its records; within a frame the boxes' own ids, and what the frame knows of
// where they begin; and what their kinds forbid.
void ColumnSearch::fill(Strip& strip, unsigned side, StripSpace& room) const {
  const Kinds* const kinds = search_.kinds && search_.kinds->words_tell() ? search_.kinds : nullptr;
  room.lay_out(strip, kinds != nullptr);
  std::fill_n(room.order.data() + strip.count, record_padding, &no_record);
  search_.kernels->transpose(strip);
  strip.framed = problem_.frame || kinds;
  if (problem_.frame) {
    for (std::uint32_t i = 0; i < strip.count; ++i) {
      const std::uint32_t label = strip.id[i];
      strip.id[i] = problem_.frame->ids[label];
      strip.begins[i] = static_cast<std::int16_t>(strip.begins[i] | problem_.frame->before[label]);
    }
  }
  if (!kinds) return;
  const std::uint8_t* const kind = kinds->of(side == 1);
  const std::uint16_t* const as_query = kinds->as_query();
  const std::uint16_t* const as_target = kinds->as_target();
  const Strip s = strip;  // of our own: what is written might else be thought to change it
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const std::uint32_t k = kind[s.id[i]], begins = static_cast<std::uint16_t>(s.begins[i]);
    s.asks[i] = static_cast<std::int16_t>(begins | as_query[k]);
    s.begins[i] = static_cast<std::int16_t>(begins | as_target[k]);
  }
}

// Each query against the targets of its own bucket (or the next, where the own one was met from the
// other side) and on. So of two boxes of different sides the one of the lower bucket asks, and of
// two of one bucket the query of the first call.
void ColumnSearch::cross(const Strip& from, const Strip& to, bool skip_own_bucket,
                         Orientation orientation) {
  std::uint32_t* starts = level_.starts.room(from.count + strip_padding);
  for (std::uint32_t i = 0; i < from.count; ++i) {
    const std::uint32_t bucket = from.bucket_of(from.lower[0][i]) + (skip_own_bucket ? 1 : 0);
    starts[i] = bucket == 0 ? 0 : to.bucket_end[bucket - 1];
  }
  search_.kernels->sweep({&from, &to, starts, orientation}, worker_);
}

// The wide boxes of a side that touch this column, against all its targets.
void ColumnSearch::sweep_wide(std::uint32_t column, unsigned side, const Strip& targets,
                              Orientation orientation) {
  const std::uint32_t wide_count = space_.wide_count_[side];
  if (wide_count == 0 || targets.count == 0) return;
  const core::Quantiser& map = plan_.map;
  const std::uint32_t here = column % map.column_count(), place = column - here;
  const std::int32_t at[3] = {static_cast<std::int32_t>(here / map.stride[0]),
                              static_cast<std::int32_t>(here / map.stride[1] % map.columns[1]),
                              static_cast<std::int32_t>(here % map.columns[2])};
  Record* clipped = level_.clipped.room(wide_count);
  const Record** order = level_.wide_strip.order.room(wide_count + record_padding);
  Strip strip;
  for (std::uint32_t i = 0; i < wide_count; ++i) {
    const Spanning& s = space_.wide_[side][i];
    bool touches = s.place == place || s.place == beyond_next;
    for (int k = 0; k < 3; ++k) {
      touches &= core::column_of(s.lower[k]) <= at[k] && at[k] <= core::column_of(s.upper[k]);
    }
    if (!touches) continue;
    Record& r = clipped[strip.count];
    order[strip.count++] = &r;
    for (int k = 0; k < 3; ++k) {
      r.lower[k] = core::lower_word(s.lower[k], at[k]);
      r.upper[k] = core::upper_word(s.upper[k], at[k]);
    }
    r.id = s.id;
  }
  if (strip.count == 0) return;
  strip.record = order;
  strip.axis = plan_.sweep_axis;
  fill(strip, side, level_.wide_strip);
  std::uint32_t* starts = level_.starts.room(strip.count + strip_padding);
  std::memset(starts, 0, strip.count * sizeof *starts);
  search_.kernels->sweep({&strip, &targets, starts, orientation}, worker_);
}

void ColumnSearch::run(std::uint32_t column, std::uint32_t next) {
  level_.segment_count = 0;
  ahead_.aim(space_, next);
  const Raw raw_a = collect(column, 0);
  const bool has_targets = problem_.targets.count != 0;
  const Raw raw_b = has_targets ? collect(column, 1) : Raw{0, 0, 0};
  if ((raw_a.records | raw_b.records) == 0) return;  // their sum may be 2^32
  Strip a, b;
  a.count = raw_a.records;
  b.count = raw_b.records;
  const std::uint32_t wanted = std::max({1u, a.count, b.count});
  std::uint32_t *in_a, *in_b = nullptr;
  // Over all words that there are, and where boxes have few of these, over those: which a plan of
  // crowded boxes expects, and what else comes to light in counting.
  constexpr Range all{0, core::top_word};
  for (Range range = plan_.crowded ? words(raw_a, raw_b) : all;; range = words(raw_a, raw_b)) {
    for (Strip* strip : {&a, &b}) set_buckets(range, wanted, *strip);
    in_a = count(raw_a, level_.query_strip, a);
    if (has_targets) in_b = count(raw_b, level_.target_strip, b);
    if (plan_.crowded || range.most - range.least != core::top_word || !crowded(a, in_a, in_b))
      break;
  }
  arrange(raw_a, 0, in_a, level_.query_strip, a);
  if (has_targets) arrange(raw_b, 1, in_b, level_.target_strip, b);

  if (!refine(search_, problem_, worker_, a, b, depth_)) {
    if (problem_.self) search_.kernels->sweep({&a, &a, nullptr, search_.forward()}, worker_);
    if (has_targets && a.count && b.count) {
      cross(a, b, false, search_.forward());
      cross(b, a, true, search_.backward());
    }
  }
  if (problem_.self) sweep_wide(column, 0, a, search_.forward());
  if (has_targets) {
    sweep_wide(column, 0, b, search_.forward());
    sweep_wide(column, 1, a, search_.backward());
  }
}

void GridSpace::find(Search& search, const Problem& problem, const core::GridPlan& plan,
                     Worker* const* team, unsigned task_count, unsigned depth) {
  const std::uint32_t* order = nullptr;
  if (task_count > 1 && columns_ > task_count) order = densest_first();
  // Long columns first, whoever comes; else to each task its own.
  Ranges ranges(columns_, order ? 1 : task_count);
  const auto column_at = [&](std::uint64_t i) {
    const auto at = static_cast<std::uint32_t>(i);
    return order ? order[at] : at;
  };
  auto task = [&](unsigned t) {
    search.guarded([&] {
      ColumnSearch columns(search, problem, plan, *this, *team[t], depth);
      for (std::uint64_t i, next; ranges.take(t, i) && !search.over();) {
        const bool known = ranges.peek(t, next);
        columns.run(column_at(i), known ? column_at(next) : LookAhead::no_column);
      }
    });
  };
  run_tasks(*search.executor, task_count, task);
  if (search.over()) return;
  search.guarded([&] { find_wide(search, problem, *team[0]); });
}

std::size_t GridSpace::foretell(Search& search, const Problem& problem, const core::GridPlan& plan,
                                Worker& worker) {
  count_records();
  ColumnSearch columns(search, problem, plan, *this, worker, 0);
  return cpu::foretell(
      search, worker, columns_, [this](std::uint32_t c) { return sizes_[c]; },
      [&](std::uint32_t c) { columns.run(c, LookAhead::no_column); });
}

// Records of each column, and of all.
std::uint64_t GridSpace::count_records() {
  std::uint32_t* sizes = sizes_.room(columns_);
  std::uint64_t total = 0;
  for (std::uint32_t c = 0; c < columns_; ++c) {
    std::uint64_t size = 0;
    for (unsigned chain = 0; chain < 2 * tasks_; ++chain) {
      const std::uintptr_t tail = tails_[std::size_t{chain} * columns_ + c];
      if (tail == 0) continue;
      const std::uintptr_t block = block_of(tail);
      size += reinterpret_cast<const Block*>(block)->before + (tail - block) / sizeof(Record);
    }
    sizes[c] = static_cast<std::uint32_t>(std::min<std::uint64_t>(size, 0xffffffffu));
    total += sizes[c];
  }
  return total;
}

// Long columns first, so that none is left for the end; where all are alike, as they lie.
const std::uint32_t* GridSpace::densest_first() {
  const std::uint64_t total = count_records();
  const std::uint32_t* sizes = sizes_.data();
  const std::uint32_t most = *std::max_element(sizes, sizes + columns_);
  if (most < 2 * (total / columns_ + 1)) return nullptr;
  std::uint32_t* order = order_.room(columns_);
  for (std::uint32_t c = 0; c < columns_; ++c) order[c] = c;
  std::sort(order, order + columns_,
            [sizes](std::uint32_t x, std::uint32_t y) { return sizes[x] > sizes[y]; });
  return order;
}

// Pairs of two wide boxes: those that no column saw.
void GridSpace::find_wide(Search& search, const Problem& problem, Worker& worker) {
  if ((wide_count_[0] | wide_count_[1]) == 0) return;
  for (unsigned side = 0; side < 2; ++side) {
    const std::uint32_t count = wide_count_[side];
    std::uint32_t* ids = wide_ids_[side].room(count + 1);
    std::uint32_t* labels = wide_labels_[side].room(count + 1);
    for (std::uint32_t i = 0; i < count; ++i) {
      labels[i] = wide_[side][i].id;
      ids[i] = problem.frame ? problem.frame->ids[labels[i]] : labels[i];
    }
  }
  Problem wide = problem;
  wide.queries = {problem.queries.boxes, wide_ids_[0].data(), wide_count_[0],
                  wide_labels_[0].data()};
  wide.targets = {problem.targets.boxes, wide_ids_[1].data(), wide_count_[1],
                  wide_labels_[1].data()};
  Worker* const team[] = {&worker};
  BinReport ignored;
  worker.set_frame(problem.frame);
  load_all_pairs(search, wide, team, ignored);
  find_all_pairs(search, wide, team, 1);
  worker.set_frame(nullptr);
}

}  // namespace throng::cpu
