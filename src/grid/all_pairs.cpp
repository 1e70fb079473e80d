#include "grid/all_pairs.hpp"

#include <algorithm>
#include <limits>

#include "base/pair_index.hpp"
#include "base/threads.hpp"
#include "grid/emit/worker.hpp"

namespace throng::grid {

void BoxTiles::load(const Search& search, const BoxSubset& side, bool is_targets,
                    BinReport& report) {
  count_ = side.count;
  const std::size_t row = Row::row_elements(count_);
  float* floats = floats_.ensure(6 * row);
  for (std::size_t k = 0; k < 6; ++k) corner_[k] = Row::row(floats, k, count_);
  std::uint32_t* ids = ids_.ensure(row);
  constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < row; ++i) {
    Box box{{nothing, nothing, nothing}, {nothing, nothing, nothing}};
    ids[i] = 0;
    if (i < count_) {
      const std::uint32_t id = side.id(static_cast<std::uint32_t>(i));
      const Box given = (*side.boxes)[id];
      ids[i] = side.label(static_cast<std::uint32_t>(i));
      if (base::is_active(given)) {
        box = search.margin != 0 ? base::expand(given, search.margin) : given;
      } else {
        report.add_inactive(id, base::has_nan(given), is_targets);
      }
    }
    const float corner[6] = {box.lower.x, box.lower.y, box.lower.z,
                             box.upper.x, box.upper.y, box.upper.z};
    for (int k = 0; k < 6; ++k) corner_[k][i] = corner[k];
  }
}

Tile BoxTiles::tile(std::uint32_t index) const noexcept {
  const std::size_t first = std::size_t{index} * tile_boxes;
  Tile tile;
  tile.count = static_cast<std::uint32_t>(std::min<std::size_t>(tile_boxes, count_ - first));
  for (int k = 0; k < 6; ++k) tile.corner[k] = corner_[k].from<16>(first);
  tile.id = ids_.data() + first;
  return tile;
}

BinReport load_all_pairs(const Job& job) {
  BinReport report;
  job.search.guarded([&] {
    const Problem& problem = job.problem;
    Worker& worker = *job.team[0];
    worker.query_floats.load(job.search, problem.queries, false, report);
    if (problem.targets.count) worker.target_floats.load(job.search, problem.targets, true, report);
  });
  return report;
}

void find_all_pairs(const Job& job) {
  Search& search = job.search;
  const Problem& problem = job.problem;
  const BoxTiles& queries = job.team[0]->query_floats;
  const BoxTiles& targets = job.team[0]->target_floats;
  const std::uint64_t rows = problem.queries.count ? queries.tile_count() : 0;
  const std::uint64_t columns = problem.targets.count ? targets.tile_count() : 0;
  // Tile pairs including the diagonal are the strict upper triangle of one more row: (r, c + 1).
  const std::uint64_t triangle = problem.self ? rows * (rows + 1) / 2 : 0;
  const std::uint64_t work = triangle + rows * columns;
  // Each term is below 2^32 squared over a tile squared, so the sum fits 64 bits. A tile index fits
  // 32 bits, as a box index does.
  constexpr std::uint64_t boxes = BoxTiles::tile_boxes;
  static_assert(boxes >= 2 && max_box_count / boxes + 2 < 0xffffffffu);
  job.team[0]->visited += box_count(problem);
  base::AtomicCounter turns(work);
  auto task = [&](unsigned t) {
    Worker& worker = *job.team[t];
    worker.use_brute_force(problem.parent);
    for (std::uint64_t k; turns.take(k) && !search.over();) {
      if (k < triangle) {
        const Pair at = base::pair_of_row_index(k, rows + 1);
        const std::uint32_t r = at.first;
        const std::uint32_t c = at.second - 1;
        search.kernels->all_pairs(queries.tile(r), queries.tile(c), r == c, search.forward(),
                                  worker);
      } else {
        const std::uint64_t cell = k - triangle;
        search.kernels->all_pairs(queries.tile(static_cast<std::uint32_t>(cell / columns)),
                                  targets.tile(static_cast<std::uint32_t>(cell % columns)), false,
                                  search.forward(), worker);
      }
    }
  };
  base::run_tasks(*search.executor, static_cast<unsigned>(job.team.size()), task);
}

}  // namespace throng::grid
