// Estimates the number of pairs before the search, by sampling independent parts: the columns of a
// grid, or worlds.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "grid/emit/pair_sink.hpp"
#include "grid/emit/worker.hpp"

namespace throng::grid {

// The sample is one in `one_in` parts, clamped to these limits.
constexpr std::uint32_t one_in = 16, least_drawn = 4, most_drawn = 24;
// Standard errors added to the estimate, and their largest accepted fraction of it.
constexpr double standard_errors = 3, close_enough = 0.125;

// Returns the expected number of pairs plus a margin, or 0 if the estimate is not close enough.
// size(i): boxes of part i; find(i) searches it. Parts are drawn at equal distances in their
// cumulated sizes, so that the probability of a part is proportional to its size, and the mean of
// pairs per box is unbiased. Resets the worker's output.
template <class Size, class Find>
std::size_t estimate_pair_count(Search& search, Worker& worker, std::uint32_t parts,
                                const Size& size, const Find& find) {
  if (parts < least_drawn * one_in) return 0;
  double boxes = 0;
  for (std::uint32_t i = 0; i < parts; ++i) boxes += static_cast<double>(size(i));
  const std::uint32_t draws = std::clamp(parts / one_in, least_drawn, most_drawn);
  BufferSink sink(nullptr, 0, nullptr, 0);
  search.sink = &sink;
  worker.begin(search);
  double sum = 0, squares = 0, before = 0;
  std::uint32_t drawn = 0;
  for (std::uint32_t i = 0; i < parts && boxes != 0 && !search.over(); ++i) {
    before += static_cast<double>(size(i));
    std::uint32_t times = 0;
    while (drawn + times < draws && (drawn + times + 0.5) * boxes <= before * draws) ++times;
    if (times == 0) continue;
    drawn += times;
    const std::uint64_t found = sink.found();
    find(i);
    worker.drain();
    const double a_box = static_cast<double>(sink.found() - found) / static_cast<double>(size(i));
    sum += times * a_box;
    squares += times * a_box * a_box;
  }
  search.sink = nullptr;
  const double mean = sum / draws;
  const double variance = std::max(0.0, squares / draws - mean * mean);
  const double errors = standard_errors * std::sqrt(variance / (draws - 1));
  if (errors > close_enough * mean) return 0;
  return static_cast<std::size_t>((mean + mean / 64 + errors) * boxes);
}

}  // namespace throng::grid
