#include "grid/emit/pair_sink.hpp"

#include <algorithm>
#include <cstring>

namespace throng::grid {

void BufferSink::take(const Pair* pairs, std::size_t count) {
  const std::uint64_t first = next_.fetch_add(count, std::memory_order_relaxed);
  if (first >= end_) return;
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, end_ - first));
  const auto inside = static_cast<std::size_t>(
      first < capacity_ ? std::min<std::uint64_t>(count, capacity_ - first) : 0);
  if (inside != 0) std::memcpy(out_ + first, pairs, inside * sizeof(Pair));
  if (inside != count)
    std::memcpy(&at(first + inside), pairs + inside, (count - inside) * sizeof(Pair));
}

bool BufferSink::extend(OutputRange& range) {
  std::uint64_t first = next_.load(std::memory_order_relaxed), size = 0;
  do {
    if (first >= capacity_) return false;
    size = std::min(max_range_pairs, (capacity_ - first) / 8);
    if (size < min_range_pairs) return false;
  } while (!next_.compare_exchange_weak(first, first + size, std::memory_order_relaxed));
  if (range.end != out_ + first) range.begin = out_ + first;
  range.end = out_ + first + size;
  return true;
}

void BufferSink::leave(OutputRange range) noexcept {
  if (range.size() == 0) return;
  empty_ += range.size();
  ranges_[range_count_++] = range;
}

void BufferSink::close() noexcept {
  std::sort(ranges_, ranges_ + range_count_,
            [](const OutputRange& a, const OutputRange& b) { return a.begin < b.begin; });
  Pair* const end = out_ + written();
  std::uint64_t last = std::min<std::uint64_t>(next_, end_);
  std::size_t behind = range_count_;  // ranges from here on lie after `last`
  const auto place = [this](const Pair* p) { return static_cast<std::uint64_t>(p - out_); };
  for (std::size_t r = 0; r < range_count_ && ranges_[r].begin < end; ++r) {
    for (Pair* to = ranges_[r].begin; to < std::min(ranges_[r].end, end); ++to) {
      while (behind > 0 && place(ranges_[behind - 1].end) == last) {
        last = place(ranges_[--behind].begin);
      }
      *to = at(--last);
    }
  }
}

void ConsumerSink::take(const Pair* pairs, std::size_t count) {
  found_.fetch_add(count, std::memory_order_relaxed);
  if (concurrent_) return call(pairs, count);
  const std::lock_guard<base::Mutex> lock(mutex_);
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
  const std::lock_guard<base::Mutex> lock(mutex_);
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

}  // namespace throng::grid
