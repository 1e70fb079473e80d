#include "cpu/sink.hpp"

#include <algorithm>
#include <cstring>

namespace throng::cpu {

// Counts of pairs cannot overflow. Two sets have at most m^2 pairs, m = max_box_count < 2^32 - 1,
// one set fewer; so there are less than 2^64 - 2^33. next_ counts beside them what was left empty:
// two rooms a worker, of most_pairs each at most.
namespace {
// A piece of the output: large enough that few are asked for, and less where little is left, so
// that no worker sits on what another needs.
constexpr std::uint64_t most_pairs = 4096, least_pairs = 512;
static_assert(max_box_count * max_box_count < ~std::uint64_t{0} - 2 * max_workers * most_pairs);
}  // namespace

void BufferSink::take(const Pair* pairs, std::size_t count) {
  const std::uint64_t at = next_.fetch_add(count, std::memory_order_relaxed);
  if (at >= capacity_) return;
  const std::uint64_t room = capacity_ - at;
  std::memcpy(out_ + at, pairs,
              static_cast<std::size_t>(count < room ? count : room) * sizeof(Pair));
}

bool BufferSink::extend(Room& room) {
  if (!direct_) return false;
  std::uint64_t at = next_.load(std::memory_order_relaxed), size = 0;
  do {
    if (at >= capacity_) return false;
    size = std::min(most_pairs, (capacity_ - at) / 8);
    if (size < least_pairs) return false;
  } while (!next_.compare_exchange_weak(at, at + size, std::memory_order_relaxed));
  if (room.end != out_ + at) room.begin = out_ + at;
  room.end = out_ + at + size;
  return true;
}

void BufferSink::leave(Room room) noexcept {
  if (room.size() == 0) return;
  empty_ += room.size();
  rooms_[room_count_++] = room;
}

void BufferSink::close() noexcept {
  if (next_ > capacity_) return;
  std::sort(rooms_, rooms_ + room_count_,
            [](const Room& a, const Room& b) { return a.begin < b.begin; });
  Pair* const end = out_ + found();
  Pair* last = out_ + next_;
  std::size_t behind = room_count_;  // rooms from here on lie behind `last`
  for (std::size_t r = 0; r < room_count_ && rooms_[r].begin < end; ++r) {
    for (Pair* to = rooms_[r].begin; to < std::min(rooms_[r].end, end); ++to) {
      while (behind > 0 && rooms_[behind - 1].end == last) last = rooms_[--behind].begin;
      *to = *--last;
    }
  }
}

void ConsumerSink::take(const Pair* pairs, std::size_t count) {
  found_.fetch_add(count, std::memory_order_relaxed);
  if (concurrent_) return call(pairs, count);
  const std::lock_guard<std::mutex> lock(mutex_);
  call(pairs, count);
}

void ConsumerSink::call(const Pair* pairs, std::size_t count) {
  if (stopped()) return;
  delivered_.fetch_add(count, std::memory_order_relaxed);
  try {
    if (!consumer_(pairs, count)) stopped_ = true;
  } catch (...) {
    const std::exception_ptr thrown = std::current_exception();
    if (concurrent_) mutex_.lock();
    if (!thrown_) thrown_ = thrown;
    if (concurrent_) mutex_.unlock();
    stopped_ = true;
  }
}

void ConsumerSink::finish() {
  if (thrown_) std::rethrow_exception(thrown_);
}

RangeSink::RangeSink(std::uint64_t begin, unsigned slice_bits, Pair* out, std::size_t capacity,
                     std::size_t slice_count) noexcept
    : begin_(begin),
      slice_bits_(slice_bits),
      slice_count_(slice_count),
      out_(out),
      capacity_(capacity) {}

void RangeSink::take(const Pair* pairs, std::size_t count) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::uint64_t found = found_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t key = std::uint64_t{pairs[i].first} << 32 | pairs[i].second;
    const std::uint64_t slice = (key - begin_) >> slice_bits_;
    if (key < begin_ || slice >= slice_count_) continue;
    ++histogram_[slice];
    if (found < capacity_) out_[found] = pairs[i];
    ++found;
  }
  found_.store(found, std::memory_order_relaxed);
}

}  // namespace throng::cpu
