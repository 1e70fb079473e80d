// Canonical (sorted) order, and pairs to a consumer under a memory cap.
#include <algorithm>
#include <bit>

#include "grid/engine_call.hpp"
#include "grid/recursion_scratch.hpp"

namespace throng::grid {
namespace {

// Sorted output in bounded memory: minimum pairs per block.
constexpr std::size_t min_sorted_block = 4096;
// And the maximum.
constexpr std::size_t max_sorted_block = std::size_t{1} << 22;

}  // namespace

// Finds into internal memory, then sorts into the caller's, which stays untouched if too small.
void Engine::find_sorted(Call& call, Output& output) {
  Output own{unordered_.data(), unordered_.capacity(), grow_pairs, &unordered_};
  find_into(call, own);
  Result& r = call.result;
  if (call.search.failed()) return;
  r.written = 0;
  const auto found = static_cast<std::size_t>(r.found);
  if (found > output.capacity) {
    if (!output.grow) {
      r.status = Status::buffer_too_small;
      return;
    }
    if (!output.grow_to(found)) throw base::AllocationFailed{r.found * sizeof(Pair)};
  }
  sorter_.sort(*call.search.kernels, *call.search.executor, call.tasks, own.data, output.data,
               found, call.search.a->size(), call.search.b->size());
  r.written = found;
  r.times.order_ms = call.clock.lap();
}

void Engine::consume(Call& call, const Consumer& consumer) {
  ConsumerSink sink(consumer, call.options.concurrent_consumer);
  pass(call, sink);
  sink.finish();
  call.result.found = sink.found();
  call.result.written = sink.delivered();
  if (!call.search.failed() && sink.stopped()) call.result.status = Status::stopped;
}

// Sorted output in bounded memory: key ranges that fit, each found and sorted separately.
void Engine::consume_sorted(Call& call, const Consumer& consumer) {
  const std::uint64_t last = call.search.a->empty() ? 0 : call.search.a->size() - 1;
  const unsigned key_bits = 32 + static_cast<unsigned>(std::bit_width(last));
  const unsigned slice_bits = key_bits > 12 ? key_bits - 12 : 0;
  bool go_on = true;
  consume_range(call, consumer, 0, slice_bits, go_on);
  if (!go_on) call.result.status = Status::stopped;
}

// Under a cap, after a pass over all pairs: gives the unused part of the cap to pair buffers, as
// each buffer-full takes another search. Reserves for other tasks the scratch of the largest, and
// for sorting a little more than is known here.
void Engine::grow_pair_buffers(const Call& call) {
  const std::size_t cap = memory_.cap();
  const std::size_t buffer_bytes = unordered_.bytes() + ordered_.bytes();
  const std::size_t held = memory_.held() - buffer_bytes, shared = grid_.held() + sorter_.held();
  const std::size_t to_come = (call.tasks - 1) * (held - shared);
  if (cap == 0 || cap < held || cap - held < to_come) return;
  const std::size_t left = (cap - held - to_come) / 8 * 7;
  const auto bytes = [&](std::size_t count) {
    return 2 * count * sizeof(Pair) + PairSorter::bytes_for(count, call.tasks);
  };
  std::size_t count = max_sorted_block;
  while (count > min_sorted_block && bytes(count) > left) count -= count / 8;
  if (count <= std::min(unordered_.capacity(), ordered_.capacity())) return;
  unordered_.release();
  ordered_.release();
  unordered_.ensure(count, true);
  ordered_.ensure(count, true);
}

// Delivers all pairs with a key in [begin, begin + slices * 2^slice_bits).
void Engine::consume_range(Call& call, const Consumer& consumer, std::uint64_t begin,
                           unsigned slice_bits, bool& go_on) {
  if (unordered_.capacity() == 0 || ordered_.capacity() == 0) {
    std::size_t count = max_sorted_block;
    if (const std::size_t cap = memory_.cap()) {
      // The rest of the cap after the fixed needs, for finding, sorting and its scratch.
      const std::size_t enough = sufficient_bytes(call);
      const std::size_t spare = cap > enough ? cap - enough : 0;
      count = std::min(max_sorted_block,
                       min_sorted_block + spare / (2 * sizeof(Pair) + 5 + 18 * call.tasks));
    }
    unordered_.ensure(count, true);
    ordered_.ensure(count, true);
  }
  std::size_t capacity = std::min(unordered_.capacity(), ordered_.capacity());

  const auto deliver = [&](std::size_t count) {
    sorter_.sort(*call.search.kernels, *call.search.executor, call.tasks, unordered_.data(),
                 ordered_.data(), count, call.search.a->size(), call.search.b->size());
    call.result.times.order_ms += call.clock.lap();
    call.result.written += count;
    if (count) go_on = consumer(ordered_.data(), count);
  };
  std::uint64_t counts[RangeSink::slices];
  {
    RangeSink sink(begin, slice_bits, unordered_.data(), capacity);
    pass(call, sink);
    if (call.search.failed()) return;
    if (call.result.found == 0) call.result.found = sink.found();  // the first pass finds all
    if (sink.found() <= capacity) return deliver(static_cast<std::size_t>(sink.found()));
    for (std::size_t s = 0; s < RangeSink::slices; ++s) counts[s] = sink.in_slice(s);
  }
  grow_pair_buffers(call);
  capacity = std::min(unordered_.capacity(), ordered_.capacity());
  for (std::size_t s = 0; s < RangeSink::slices && go_on && !call.search.failed();) {
    std::uint64_t sum = counts[s];
    const std::uint64_t at = begin + (std::uint64_t{s} << slice_bits);
    if (sum > capacity) {
      // A slice of 2^0 keys holds at most one pair, so a larger slice that does not fit can be
      // divided.
      const unsigned finer = slice_bits > 12 ? slice_bits - 12 : 0;
      consume_range(call, consumer, at, finer, go_on);
      ++s;
      continue;
    }
    std::size_t end = s + 1;
    while (end < RangeSink::slices && sum + counts[end] <= capacity) sum += counts[end++];
    if (sum) {
      RangeSink sink(at, slice_bits, unordered_.data(), capacity, end - s);
      pass(call, sink);
      if (call.search.failed()) return;
      deliver(static_cast<std::size_t>(sink.found()));
    }
    s = end;
  }
}

// A cap under which this call does not fail: all held memory, and a generous bound for the largest
// column of a grid.
std::size_t Engine::sufficient_bytes(const Call& call) const noexcept {
  return sufficient_bytes(call, box_count(call.search));
}

std::size_t Engine::sufficient_bytes(const Options& options, std::uint64_t boxes,
                                     bool has_worlds) const noexcept {
  Call call(options);
  call.tasks = threads_for(boxes, options);
  call.partitioned = has_worlds;
  return sufficient_bytes(call, boxes);
}

std::size_t Engine::sufficient_bytes(const Call& call, std::uint64_t boxes) const noexcept {
  const double records =
      std::max<double>(static_cast<double>(grid_.record_bound()),
                       static_cast<double>(boxes) * std::max(1.5, 1.25 * call.plan.replicas));
  const double columns = call.plan.column_count();
  const double column = std::min(records, 8 * records / columns + 4096);
  const double tasks = call.tasks;
  // A column's boxes: ordered records, quantized coordinates, bit columns, buckets, ids; see
  // StripStorage.
  constexpr double bytes_a_record = 1.125 * (16 + 12 + 24 + 16);
  const double fixed = tasks * (sizeof(Worker) + sizeof(RecursionScratch) + 65536) + sizeof(Engine);
  const double chains = columns * tasks * (2 * sizeof(std::uintptr_t) + 2 * 4096);
  const double worlds = call.partitioned ? 256.0 * static_cast<double>(boxes) : 0;
  const double in_order =
      call.options.order != Order::canonical
          ? 0
          : static_cast<double>(2 * min_sorted_block * sizeof(Pair) +
                                PairSorter::bytes_for(min_sorted_block, call.tasks));
  const double rounded = call.doubles.a ? sizeof(Box) * static_cast<double>(boxes) : 0;
  const double all = rounded + fixed + chains + worlds + in_order +
                     64.0 * static_cast<double>(boxes) + records * 20 +
                     tasks * column * bytes_a_record;
  return static_cast<std::size_t>(all);
}

}  // namespace throng::grid
