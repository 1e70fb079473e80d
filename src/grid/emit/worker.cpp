#include "grid/emit/worker.hpp"

#include <algorithm>
#include <cstring>

#include "base/packed_box.hpp"
#include "base/prefetch.hpp"
#include "grid/recursion_scratch.hpp"

namespace throng::grid {

Worker::Worker(base::Memory& memory) noexcept
    : dummy_block(memory),
      bin_buffers(memory),
      query_floats(memory),
      target_floats(memory),
      memory_(&memory),
      confirmed_(memory),
      ties_(memory) {}

Worker::~Worker() {
  for (RecursionScratch* scratch : scratch_) memory_->destroy(scratch);
}

RecursionScratch& Worker::scratch(unsigned depth) {
  if (!scratch_[depth]) scratch_[depth] = memory_->create<RecursionScratch>(*memory_);
  return *scratch_[depth];
}

void Worker::match(const Worker& other) {
  dummy_block.match(other.dummy_block);
  bin_buffers.match(other.bin_buffers);
  query_floats.match(other.query_floats);
  target_floats.match(other.target_floats);
  for (unsigned depth = 0; depth <= max_depth; ++depth) {
    if (other.scratch_[depth]) scratch(depth).match(*other.scratch_[depth]);
  }
}

void Worker::begin(Search& search) {
  search_ = &search;
  comparisons = visited = 0;
  target_id_offset = search.target_id_offset;
  confirmed_.ensure(staging_pairs + slack, true);
  gap_ = range_ = OutputRange{};
  tie_cursor = ties_.ensure(staging_ties + slack, true);
  tie_limit = tie_cursor + staging_ties;
  set_source(Source::sweep, nullptr);
}

// From now on pairs are staged.
void Worker::start_staging() noexcept {
  direct_ = false;
  cursor = confirmed_.data();
  limit = cursor + staging_pairs;
}

// From now on pairs go directly to the output, while it has space.
void Worker::write_directly() {
  if (range_.size() < slack) {
    OutputRange next = range_;
    if (!search_->sink->extend(next)) return start_staging();
    if (next.begin != range_.begin) gap_ = range_;
    range_ = next;
  }
  direct_ = true;
  cursor = range_.begin;
  limit = range_.end - slack;
}

void Worker::set_source(Source source, const ParentCell* parent) {
  const Search& s = *search_;
  const bool all = source == Source::brute_force;
  source_ = source;
  parent_ = parent;
  check_classes_ = s.filter_classes && (all || !s.filter_classes->masks_cover_all());
  check_worlds_ = s.any_worlds || (all && s.wide_worlds);
  check_doubles_ = all && s.doubles;
  const bool filtered =
      check_classes_ || check_worlds_ || check_doubles_ || s.owners || s.pair_test;
  if (s.sink && !parent && !filtered)
    write_directly();
  else
    start_staging();
}

void Worker::switch_to(Source source, const ParentCell* parent) {
  if (source == source_ && parent == parent_) return;
  drain();
  set_source(source, parent);
}

void Worker::drain() {
  flush_ties();
  if (direct_)
    range_.begin = cursor;
  else
    flush();
}

void Worker::finish() {
  drain();
  search_->sink->leave(range_);
  search_->sink->leave(gap_);
}

// The output range is full but for its slack. Fills the gap with the last pairs of this range.
void Worker::next_range() {
  if (gap_.size() != 0) {
    const std::size_t size = gap_.size();  // a range holds more
    cursor -= size;
    std::memcpy(gap_.begin, cursor, size * sizeof(Pair));
    gap_ = OutputRange{};
    if (cursor <= limit) return;
  }
  range_.begin = cursor;
  write_directly();
}

void Worker::flush() {
  if (direct_) return next_range();
  Pair* pairs = confirmed_.data();
  std::size_t count = static_cast<std::size_t>(cursor - pairs);
  cursor = pairs;
  if (parent_) count = resolve_labels(pairs, count);
  count = filter(pairs, count);
  for (OutputRange* range : {&gap_, &range_}) {
    const std::size_t part = std::min(count, range->size());
    if (part == 0) continue;
    count -= part;
    std::memcpy(range->begin, pairs + count, part * sizeof(Pair));
    range->begin += part;
  }
  if (count) search_->sink->take(pairs, count);
}

// Decides ties by the input floats. They are scattered in memory, so they are prefetched.
void Worker::flush_ties() {
  const Search& s = *search_;
  const Pair* pairs = ties_.data();
  const std::size_t count = static_cast<std::size_t>(tie_cursor - pairs);
  tie_cursor = ties_.data();
  const auto put = [&](Pair pair, bool overlap) {
    *cursor = pair;
    cursor += overlap;
    if (cursor > limit) flush();
  };
  constexpr std::size_t ahead = 12;
  const auto upcoming = [&](std::size_t i) { return pairs[std::min(i + ahead, count - 1)]; };
  if (s.doubles) {
    for (std::size_t i = 0; i < count; ++i) {
      s.doubles->prefetch(upcoming(i));
      put(pairs[i], s.doubles->overlap(pairs[i]));
    }
    return;
  }
  if (s.margin != 0 || !s.a->packed_data() || !s.b->packed_data()) {
    for (std::size_t i = 0; i < count; ++i) {
      put(pairs[i], base::overlaps(s.box(*s.a, pairs[i].first), s.box(*s.b, pairs[i].second)));
    }
    return;
  }
  const auto first = [boxes = s.a->packed_data(), stride = s.a->stride_bytes()](Pair pair) {
    return boxes + pair.first * stride;
  };
  const auto second = [boxes = s.b->packed_data(), stride = s.b->stride_bytes()](Pair pair) {
    return boxes + pair.second * stride;
  };
  for (std::size_t i = 0; i < count; ++i) {
    base::prefetch_l2(first(upcoming(i)));
    base::prefetch_l2(second(upcoming(i)));
    put(pairs[i], base::overlap_in_memory(first(pairs[i]), second(pairs[i])));
  }
}

// Maps labels to ids; drops pairs that another column owns.
std::size_t Worker::resolve_labels(Pair* pairs, std::size_t count) const noexcept {
  const std::uint32_t* ids = parent_->ids;
  const RejectMask* masks = parent_->masks;
  const Orientation orientation = search_->forward();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Pair label = pairs[i];
    pairs[kept] = make_pair(orientation, ids[label.first], ids[label.second]);
    kept += !masks[label.first].rejects(masks[label.second]);
  }
  return kept;
}

namespace {

// Moves the allowed pairs to the front and returns their number. Branch-free: filter results are
// unpredictable.
template <class Allowed>
std::size_t compact_allowed(Pair* pairs, std::size_t count, const Allowed& allowed) noexcept {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Pair pair = pairs[i];
    pairs[kept] = pair;
    kept += allowed(pair);
  }
  return kept;
}

// An absent filter of the two is all ones.
std::size_t keep_by_group(const Strided<std::uint32_t>& group, const Strided<std::uint32_t>& mask,
                          std::uint32_t Pair::*of_group, std::uint32_t Pair::*of_mask, Pair* pairs,
                          std::size_t count) noexcept {
  if (group && mask) {
    return compact_allowed(pairs, count, [=](Pair pair) {
      return (group[pair.*of_group] & mask[pair.*of_mask]) != 0;
    });
  }
  const Strided<std::uint32_t>& given = group ? group : mask;
  const auto of = group ? of_group : of_mask;
  return given ? compact_allowed(pairs, count, [=](Pair pair) { return given[pair.*of] != 0; })
               : count;
}

}  // namespace

std::size_t Worker::filter(Pair* pairs, std::size_t count) const noexcept {
  const Filters& a = search_->a->filters;
  const Filters& b = search_->b->filters;
  if (check_classes_) {
    count = compact_allowed(pairs, count, search_->filter_classes->allowed());
    if (!search_->filter_classes->grouped()) {
      count = keep_by_group(a.group, b.mask, &Pair::first, &Pair::second, pairs, count);
      count = keep_by_group(b.group, a.mask, &Pair::second, &Pair::first, pairs, count);
    }
  }
  if (check_worlds_) {
    count = compact_allowed(pairs, count, [a = a.world, b = b.world](Pair pair) {
      const std::int32_t first = a[pair.first], second = b[pair.second];
      return (first == second) | (first == -1) | (second == -1);
    });
  }
  if (search_->owners) {
    count = compact_allowed(pairs, count, [a = a.owner, b = b.owner](Pair pair) {
      const std::int32_t owner = a[pair.first];
      return (owner == -1) | (owner != b[pair.second]);
    });
  }
  if (check_doubles_) {
    count =
        compact_allowed(pairs, count, [&](Pair pair) { return search_->doubles->overlap(pair); });
  }
  if (!search_->pair_test || count == 0) return count;
  // Tests are long: a search that is to stop does not wait for those of a column.
  return search_->over() ? 0 : search_->pair_test->keep(pairs, count);
}

}  // namespace throng::grid
