#include "cpu/sink.hpp"

#include <cstring>

namespace throng::cpu {

void BufferSink::take(const Pair* pairs, std::size_t count) {
  const std::uint64_t at = found_.fetch_add(count, std::memory_order_relaxed);
  if (at >= capacity_) return;
  const std::uint64_t room = capacity_ - at;
  std::memcpy(out_ + at, pairs,
              static_cast<std::size_t>(count < room ? count : room) * sizeof(Pair));
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
