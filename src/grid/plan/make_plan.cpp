#include "grid/plan/make_plan.hpp"

#include <algorithm>

#include "base/cost_table.hpp"
#include "base/prefetch.hpp"

namespace throng::grid {
namespace {

// Samples boxes evenly, with jitter against regular patterns in their order. They are scattered, so
// all are prefetched before the first is read.
std::uint32_t sample_subset(const Search& search, const BoxSubset& side, std::uint32_t wanted,
                            Box* out) {
  const std::uint32_t count = std::min(wanted, side.count);
  if (count == 0) return 0;
  const Boxes& boxes = *side.boxes;
  const char* const packed = boxes.packed_data();
  // Sampling distance in units of 2^-32; the jitter is 0 if all boxes are taken.
  const std::uint64_t step = (std::uint64_t{side.count} << 32) / count;
  const std::uint64_t gap = step >> 32;
  std::uint32_t ids[max_sample];
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint64_t jitter = (i * 0x9e3779b1u) * gap >> 32;
    const std::uint64_t at = (i * step >> 32) + jitter;
    ids[i] = side.id(static_cast<std::uint32_t>(std::min<std::uint64_t>(at, side.count - 1)));
    if (!packed) continue;
    const char* const box = packed + ids[i] * boxes.stride_bytes();
    base::prefetch_l2(box);
    base::prefetch_l2(box + sizeof(Box) - sizeof(float));
  }
  std::uint32_t taken = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    out[taken] = search.box(boxes, ids[i]);
    taken += base::is_active(out[taken]);
  }
  return taken;
}

}  // namespace

Stats sample_stats(const Search& search, const Problem& problem) {
  const std::uint64_t queries = problem.queries.count, boxes = box_count(problem);
  const std::uint32_t wanted = sample_size(boxes);
  Box sample[max_sample];
  const auto query_share =
      static_cast<std::uint32_t>(wanted * queries / std::max<std::uint64_t>(boxes, 1));
  const std::uint32_t first = std::max(query_share, std::min(wanted / 8, problem.queries.count));
  std::uint32_t count = sample_subset(search, problem.queries, std::min(first, wanted), sample);
  count += sample_subset(search, problem.targets, wanted - std::min(first, wanted), sample + count);
  Stats stats = measure(sample, count, boxes, boxes);
  stats.comparisons = brute_force_comparisons(problem);
  return stats;
}

GridPlan make_plan(const Search& search, const Problem& problem, Algorithm forced) {
  const std::uint64_t boxes = box_count(problem);
  if (static_cast<double>(boxes) <= base::cost.brute_force_boxes ||
      forced == Algorithm::all_pairs) {
    Stats few;
    few.query_count = problem.queries.count;
    few.target_count = boxes;
    few.comparisons = brute_force_comparisons(problem);
    if (forced != Algorithm::grid)
      return grid::plan(few, *search.kernels->sweep_cost, forced, search.cell_scale);
  }
  return grid::plan(sample_stats(search, problem), *search.kernels->sweep_cost, forced,
                    search.cell_scale);
}

}  // namespace throng::grid
