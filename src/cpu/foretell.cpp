// How many pairs there will be, before they are found: from a few columns.
#include <algorithm>
#include <cmath>

#include "cpu/grid.hpp"

namespace throng::cpu {
namespace {

// One column in so many is searched, these at least and at most.
constexpr std::uint32_t one_in = 16, least = 4, most = 24;
// So many standard errors are added to what is expected, if they are so small a part of it.
constexpr double errors = 3, close = 0.125;

}  // namespace

// Columns are drawn at even distances of their records, so that a column is the more likely to be
// drawn the longer it is, and the mean of the pairs a record is that of all.
std::size_t GridSpace::foretell(Search& search, const Problem& problem, const core::GridPlan& plan,
                                Worker& worker) {
  if (columns_ < least * one_in) return 0;
  const auto records = static_cast<double>(count_records());
  if (records == 0) return 0;
  const std::uint32_t draws = std::clamp(columns_ / one_in, least, most);
  BufferSink sink(nullptr, 0, nullptr, 0);
  search.sink = &sink;
  worker.begin(search);
  double sum = 0, squares = 0, before = 0;
  std::uint32_t drawn = 0;
  for (std::uint32_t c = 0; c < columns_ && !search.over(); ++c) {
    before += sizes_[c];
    std::uint32_t times = 0;
    while (drawn + times < draws && (drawn + times + 0.5) * records <= before * draws) ++times;
    if (times == 0) continue;
    drawn += times;
    const std::uint64_t found = sink.found();
    find_in(search, problem, plan, worker, c);
    worker.drain();
    const double a_record = static_cast<double>(sink.found() - found) / sizes_[c];
    sum += times * a_record;
    squares += times * a_record * a_record;
  }
  const double mean = sum / draws;
  const double variance = std::max(0.0, squares / draws - mean * mean);
  const double error = std::sqrt(variance / (draws - 1));
  search.sink = nullptr;
  if (errors * error > close * mean) return 0;
  return static_cast<std::size_t>((mean + mean / 64 + errors * error) * records);
}

}  // namespace throng::cpu
