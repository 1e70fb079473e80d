// Host implementation of cuda/pair_sorter.cuh.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "device/pair_sorter.hpp"

namespace throng::device {

// Small, so that tests take every path.
struct HostSortSizes {
  static constexpr std::uint32_t block_pairs = 256, bins = 256, run = 4, single_block_pairs = 100;
  static constexpr std::uint32_t min_buckets = 4, min_per_bucket = 32, max_per_bucket = 116;
  static constexpr std::uint32_t max_buckets = 256;
};

template <class Order>
void sort_task(const Order& order, const typename Order::Shape& shape,
               const typename Order::Task& task) {
  PackedPair placed[Order::block_pairs];
  std::uint32_t counts[Order::bins] = {}, sum = 0, most = 0;
  const std::uint32_t size = task.last() - task.first;
  order.count_bins(shape, task, 0, 1, counts);
  for (std::uint32_t& count : counts) {
    most = std::max(most, count);
    count = std::exchange(sum, sum + count);
  }
  order.place(shape, task, 0, 1, counts, placed);
  PackedPair* from = placed;
  PackedPair* to = order.words + task.first;
  for (std::uint32_t i = 0; i < size; ++i) {
    const std::uint32_t at = order.ranked(shape, from, counts, i);
    if (most > Order::run_pairs)
      to[at] = from[i];
    else
      order.deliver(task, at, from[i]);
  }
  for (std::uint32_t width = Order::run_pairs; width < most; width *= 4) {
    std::swap(from, to);
    for (std::uint32_t i = 0; i < size; ++i) {
      const std::uint32_t at = order.merged(shape, from, counts, i, width);
      if (4 * width < most)
        to[at] = from[i];
      else
        order.deliver(task, at, from[i]);
    }
  }
}

// share(n, body) calls body(0) .. body(n-1) on several threads and returns when all have returned.
template <class Order, class Share>
void sort_pairs(const Order& order, const Share& share) {
  const std::uint32_t found = order.found();
  if (found == 0) return;
  const typename Order::Shape shape = order.shape(found);
  if (shape.buckets == 1) {
    for (std::uint32_t i = 0; i < found; ++i) order.words[i] = load(order.pairs + i);
    return sort_task(order, shape, {0, found, 0});
  }
  constexpr std::uint32_t blocks = 3;
  std::uint32_t counts[blocks][Order::bins] = {};
  std::fill_n(order.totals, shape.buckets, 0u);
  share(blocks, [&](std::uint32_t b) { order.count(shape, found, b, blocks, counts[b]); });
  share(blocks, [&](std::uint32_t b) {
    for (std::uint32_t k = 0; k < shape.buckets; ++k) order.reserve(k, counts[b]);
  });
  typename Order::Place all{};
  std::uint32_t most = 0;
  for (std::uint32_t k = 0; k < shape.buckets; ++k) {
    const std::uint32_t pairs = order.totals[k];
    order.add_tasks(pairs, all);
    for (std::uint32_t* own : counts) own[k] += all.pairs;
    all = all + Order::size(pairs);
    most = std::max(most, pairs);
  }
  share(blocks, [&](std::uint32_t b) { order.scatter(shape, found, b, blocks, counts[b]); });
  share(all.large + all.small, [&](std::uint32_t k) {
    sort_task(order, shape, k < all.large ? order.large[k] : order.small[k - all.large]);
  });
  const std::uint32_t passes = Order::passes(most);
  for (std::uint32_t pass = 0; pass < passes; ++pass)
    share(all.large, [&](std::uint32_t k) {
      const typename Order::Task task = order.large[k];
      for (std::uint32_t i = task.first; i < task.last(); ++i) order.merge(task, i, pass, passes);
    });
}

}  // namespace throng::device
