#include "cpu/worker.hpp"

#include <algorithm>
#include <cstring>

#include "cpu/grid.hpp"
#include "cpu/packed_box.hpp"
#include "cpu/prefetch.hpp"

namespace throng::cpu {

namespace {

std::size_t row_of(std::uint32_t count) { return (count + strip_padding + 63) / 64 * 64; }

}  // namespace

void StripSpace::reserve(std::uint32_t count, bool with_kinds) {
  order.room(count + record_padding);
  ranks.room(count);
  buckets.room(count + 1);
  words.room((with_kinds ? 8 : 7) * row_of(count));
  ids.room(row_of(count));
}

void StripSpace::lay_out(Strip& strip, bool with_kinds) {
  const std::size_t row = row_of(strip.count);
  std::int16_t* w = words.room((with_kinds ? 8 : 7) * row);
  for (int k = 0; k < 3; ++k) {
    strip.lower[k] = w + 2 * k * row;
    strip.upper[k] = w + (2 * k + 1) * row;
  }
  strip.begins = w + 6 * row;
  strip.asks = with_kinds ? w + 7 * row : strip.begins;
  strip.id = ids.room(row);
}

void StripSpace::match(const StripSpace& other) {
  order.match(other.order);
  ranks.match(other.ranks);
  words.match(other.words);
  ids.match(other.ids);
  buckets.match(other.buckets);
}

Worker::Worker(Memory& memory) noexcept
    : dummy_block(memory),
      bin_buffers(memory),
      query_floats(memory),
      target_floats(memory),
      memory_(&memory),
      sure_(memory),
      unsure_(memory) {
  flush = flush_sure;
  flush_maybe = flush_unsure;
}

Worker::~Worker() {
  for (Level* level : levels_) memory_->destroy(level);
}

Level& Worker::level(unsigned depth) {
  if (!levels_[depth]) levels_[depth] = memory_->create<Level>(*memory_);
  return *levels_[depth];
}

void Worker::match(const Worker& other) {
  dummy_block.match(other.dummy_block);
  bin_buffers.match(other.bin_buffers);
  query_floats.match(other.query_floats);
  target_floats.match(other.target_floats);
  for (unsigned depth = 0; depth <= max_depth; ++depth) {
    if (other.levels_[depth]) level(depth).match(*other.levels_[depth]);
  }
}

void Worker::begin(Search& search) {
  search_ = &search;
  comparisons = visited = 0;
  second_base = search.second_base;
  sure_.room(staging_pairs + emit_slack, true);
  gap_ = room_ = Room{};
  maybe_cursor = unsure_.room(staging_maybe + emit_slack, true);
  maybe_limit = maybe_cursor + staging_maybe;
  take_from(Source::words, nullptr);
}

// From now on pairs are staged.
void Worker::stage() noexcept {
  direct_ = false;
  cursor = sure_.data();
  limit = cursor + staging_pairs;
}

// From now on pairs go directly to the output, while it has space.
void Worker::go_straight() {
  if (room_.size() < emit_slack) {
    Room next = room_;
    if (!search_->sink->extend(next)) return stage();
    if (next.begin != room_.begin) gap_ = room_;
    room_ = next;
  }
  direct_ = true;
  cursor = room_.begin;
  limit = room_.end - emit_slack;
}

void Worker::take_from(Source source, const Frame* frame) {
  const Search& s = *search_;
  const bool all = source == Source::brute_force;
  source_ = source;
  frame_ = frame;
  ask_kinds_ = s.kinds && (all || !s.kinds->words_tell_all());
  ask_worlds_ = s.any_worlds || (all && s.wide_worlds);
  ask_doubles_ = all && s.doubles;
  const bool ask = ask_kinds_ || ask_worlds_ || ask_doubles_ || s.owners;
  if (s.sink && !frame && !ask)
    go_straight();
  else
    stage();
}

void Worker::switch_to(Source source, const Frame* frame) {
  if (source == source_ && frame == frame_) return;
  drain();
  take_from(source, frame);
}

void Worker::drain() {
  flush_unsure(this);
  if (direct_)
    room_.begin = cursor;
  else
    flush_sure(this);
}

void Worker::finish() {
  drain();
  search_->sink->leave(room_);
  search_->sink->leave(gap_);
}

// The output range is full but for its slack. Fills the gap with the last pairs of this range.
void Worker::next_room() {
  if (gap_.size() != 0) {
    const std::size_t size = gap_.size();  // a range holds more
    cursor -= size;
    std::memcpy(gap_.begin, cursor, size * sizeof(Pair));
    gap_ = Room{};
    if (cursor <= limit) return;
  }
  room_.begin = cursor;
  go_straight();
}

void Worker::flush_sure(Emit* emit) {
  Worker& w = *static_cast<Worker*>(emit);
  if (w.direct_) return w.next_room();
  Pair* pairs = w.sure_.data();
  std::size_t count = static_cast<std::size_t>(w.cursor - pairs);
  w.cursor = pairs;
  if (w.frame_) count = w.leave_frame(pairs, count);
  count = w.filter(pairs, count);
  for (Room* room : {&w.gap_, &w.room_}) {
    const std::size_t part = std::min(count, room->size());
    if (part == 0) continue;
    count -= part;
    std::memcpy(room->begin, pairs + count, part * sizeof(Pair));
    room->begin += part;
  }
  if (count) w.search_->sink->take(pairs, count);
}

// Decides ties by the input floats. They are scattered in memory, so they are prefetched.
void Worker::flush_unsure(Emit* emit) {
  Worker& w = *static_cast<Worker*>(emit);
  const Search& s = *w.search_;
  const Pair* pairs = w.unsure_.data();
  const std::size_t count = static_cast<std::size_t>(w.maybe_cursor - pairs);
  w.maybe_cursor = w.unsure_.data();
  const auto put = [&](Pair pair, bool overlap) {
    *w.cursor = pair;
    w.cursor += overlap;
    if (w.cursor > w.limit) flush_sure(emit);
  };
  constexpr std::size_t ahead = 12;
  const auto soon = [&](std::size_t i) { return pairs[std::min(i + ahead, count - 1)]; };
  if (s.doubles) {
    for (std::size_t i = 0; i < count; ++i) {
      s.doubles->prefetch(soon(i));
      put(pairs[i], s.doubles->overlap(pairs[i]));
    }
    return;
  }
  if (s.margin != 0 || !s.a->packed_data() || !s.b->packed_data()) {
    for (std::size_t i = 0; i < count; ++i) {
      put(pairs[i], core::overlaps(s.box(*s.a, pairs[i].first), s.box(*s.b, pairs[i].second)));
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
    prefetch_to_read(first(soon(i)));
    prefetch_to_read(second(soon(i)));
    put(pairs[i], overlap_in_memory(first(pairs[i]), second(pairs[i])));
  }
}

// Maps labels to ids; drops pairs that another column owns.
std::size_t Worker::leave_frame(Pair* pairs, std::size_t count) const noexcept {
  const std::uint32_t* ids = frame_->ids;
  const std::uint16_t* before = frame_->before;
  const Orientation orientation = search_->forward();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Pair label = pairs[i];
    pairs[kept] = make_pair(orientation, ids[label.first], ids[label.second]);
    kept += (before[label.first] & before[label.second]) == 0;
  }
  return kept;
}

namespace {

// Moves the allowed pairs to the front and returns their number. Branch-free: filter results are
// unpredictable.
template <class Allowed>
std::size_t keep(Pair* pairs, std::size_t count, const Allowed& allowed) noexcept {
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
    return keep(pairs, count,
                [=](Pair pair) { return (group[pair.*of_group] & mask[pair.*of_mask]) != 0; });
  }
  const Strided<std::uint32_t>& given = group ? group : mask;
  const auto of = group ? of_group : of_mask;
  return given ? keep(pairs, count, [=](Pair pair) { return given[pair.*of] != 0; }) : count;
}

}  // namespace

std::size_t Worker::filter(Pair* pairs, std::size_t count) const noexcept {
  const Filters& a = search_->a->filters;
  const Filters& b = search_->b->filters;
  if (ask_kinds_) {
    count = keep(pairs, count, search_->kinds->allowed());
    if (!search_->kinds->grouped()) {
      count = keep_by_group(a.group, b.mask, &Pair::first, &Pair::second, pairs, count);
      count = keep_by_group(b.group, a.mask, &Pair::second, &Pair::first, pairs, count);
    }
  }
  if (ask_worlds_) {
    count = keep(pairs, count, [a = a.world, b = b.world](Pair pair) {
      const std::int32_t first = a[pair.first], second = b[pair.second];
      return (first == second) | (first == -1) | (second == -1);
    });
  }
  if (search_->owners) {
    count = keep(pairs, count, [a = a.owner, b = b.owner](Pair pair) {
      const std::int32_t owner = a[pair.first];
      return (owner == -1) | (owner != b[pair.second]);
    });
  }
  if (!ask_doubles_) return count;
  return keep(pairs, count, [&](Pair pair) { return search_->doubles->overlap(pair); });
}

}  // namespace throng::cpu
