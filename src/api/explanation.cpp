#include "explanation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>

#include "base/bounds.hpp"
#include "base/quantize.hpp"
#include "base/threads.hpp"
#include "grid/engine.hpp"
#include "grid/plan/planner.hpp"

namespace throng {
namespace {

constexpr std::size_t max_listed = 10;

float largest_extent(const Box& b) noexcept {
  return std::max({b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z});
}

// The class of a size: 0 for no extent, then one per power of two; infinity is the last.
int class_of(float extent) noexcept {
  if (!(extent > 0)) return 0;
  if (!(extent < std::numeric_limits<float>::infinity())) return 279;
  return std::ilogb(extent) + 150;  // the smallest denormal is 2^-149
}
float class_begin(int k) noexcept {
  return k == 0     ? -1.0f
         : k == 279 ? std::numeric_limits<float>::infinity()
                    : std::ldexp(1.0f, k - 150);
}

// Boxes per cell of a grid, by a 3-D difference array: eight additions per box, however many cells
// it touches.
class Occupancy {
 public:
  explicit Occupancy(const base::Quantizer& map) : map_(map) {
    for (int k = 0; k < 3; ++k) count_[k] = map.columns[k] + 1;
    differences_.resize(std::size_t{count_[0]} * count_[1] * count_[2]);
  }

  // Adds an active box; returns how many cells it touches.
  std::uint64_t add(const Box& b) {
    const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
    const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
    std::uint32_t ends[2][3];
    std::uint64_t cells = 1;
    for (int k = 0; k < 3; ++k) {
      ends[0][k] = static_cast<std::uint32_t>(base::column_of(base::quantize(map_, k, lower[k])));
      ends[1][k] =
          static_cast<std::uint32_t>(base::column_of(base::quantize(map_, k, upper[k]))) + 1;
      cells *= ends[1][k] - ends[0][k];
    }
    for (unsigned corner = 0; corner < 8; ++corner) {
      const std::int64_t sign = corner == 0 || corner == 3 || corner == 5 || corner == 6 ? 1 : -1;
      differences_[at(ends[corner & 1][0], ends[corner >> 1 & 1][1], ends[corner >> 2][2])] += sign;
    }
    return cells;
  }

  void finish(Explanation& e) {
    std::vector<Explanation::CellClass> classes(65);  // by bit width of the box count
    for (int axis = 0; axis < 3; ++axis) sum_along(axis);
    e.occupancy.reserve(map_.column_count());
    for (std::uint32_t x = 0; x < map_.columns[0]; ++x)
      for (std::uint32_t y = 0; y < map_.columns[1]; ++y)
        for (std::uint32_t z = 0; z < map_.columns[2]; ++z) {
          const auto boxes = static_cast<std::uint64_t>(differences_[at(x, y, z)]);
          e.entries += boxes;
          e.occupied += boxes > 0;
          e.occupancy.push_back(static_cast<std::uint32_t>(boxes));
          if (boxes == 0) continue;
          Explanation::CellClass& box_class =
              classes[static_cast<std::size_t>(std::bit_width(boxes))];
          ++box_class.cells;
          box_class.boxes += boxes;
          if (e.densest.size() == max_listed && boxes <= e.densest.back().boxes) continue;
          const Explanation::DenseCell cell{bounds(x, y, z), boxes};
          const auto denser = [](const auto& p, const auto& q) { return p.boxes > q.boxes; };
          e.densest.insert(std::upper_bound(e.densest.begin(), e.densest.end(), cell, denser),
                           cell);
          if (e.densest.size() > max_listed) e.densest.pop_back();
        }
    e.cells = map_.column_count();
    const Box first = bounds(0, 0, 0);
    const Box last = bounds(map_.columns[0] - 1, map_.columns[1] - 1, map_.columns[2] - 1);
    e.grid = {first.lower, last.upper};
    for (unsigned width = 1; width < 65; ++width) {
      Explanation::CellClass& c = classes[width];
      if (c.cells == 0) continue;
      c.from = std::uint64_t{1} << (width - 1);
      c.below = width < 64 ? c.from * 2 : ~std::uint64_t{0};
      e.cell_classes.push_back(c);
    }
  }

 private:
  std::size_t at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const noexcept {
    return (std::size_t{x} * count_[1] + y) * count_[2] + z;
  }
  void sum_along(int axis) {
    const std::size_t step[3] = {std::size_t{count_[1]} * count_[2], count_[2], 1};
    for (std::size_t i = 0; i < differences_.size(); ++i) {
      if (i / step[axis] % count_[axis] != 0) differences_[i] += differences_[i - step[axis]];
    }
  }
  Box bounds(std::uint32_t x, std::uint32_t y, std::uint32_t z) const noexcept {
    const std::uint32_t cell[3] = {x, y, z};
    float ends[2][3];
    for (int k = 0; k < 3; ++k) {
      for (std::uint32_t e = 0; e < 2; ++e) {
        const double words = static_cast<double>(base::steps_per_column) * (cell[k] + e);
        const double position =
            words / static_cast<double>(map_.scale[k]) + static_cast<double>(map_.origin[k]);
        ends[e][k] = static_cast<float>(base::coordinate_at(map_, k, position));
      }
    }
    return {{ends[0][0], ends[0][1], ends[0][2]}, {ends[1][0], ends[1][1], ends[1][2]}};
  }

  base::Quantizer map_;
  std::uint32_t count_[3];
  std::vector<std::int64_t> differences_;
};

void add_boxes(const Boxes& boxes, bool second, float margin, Occupancy* cells, Explanation& e,
               std::vector<Explanation::SizeClass>& classes) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    Box b = boxes[i];
    if (margin != 0) b = base::expand(b, margin);
    if (!base::is_active(b)) continue;
    const float extent = largest_extent(b);
    const std::uint64_t touched = cells ? cells->add(b) : 0;
    Explanation::SizeClass& size_class = classes[static_cast<std::size_t>(class_of(extent))];
    ++size_class.boxes;
    size_class.cells_per_box += static_cast<double>(touched);
    if (e.largest.size() == max_listed && extent <= e.largest.back().extent) continue;
    const Explanation::LargeBox large{static_cast<std::uint32_t>(i), second, extent, touched};
    const auto larger = [](const auto& p, const auto& q) { return p.extent > q.extent; };
    e.largest.insert(std::upper_bound(e.largest.begin(), e.largest.end(), large, larger), large);
    if (e.largest.size() > max_listed) e.largest.pop_back();
  }
}

#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void advise(Explanation& e, const char* format, ...) {
  char text[300];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  e.advice.emplace_back(text);
}

void give_advice(Explanation& e, const Options& options) {
  const Result& r = e.result;
  const double boxes = static_cast<double>(e.boxes);
  if (static_cast<double>(r.inactive) > 0.25 * boxes && e.boxes > 1000) {
    advise(e,
           "%.0f %% of the boxes overlap nothing (lower > upper, or NaN), and each is still read: "
           "leave them out",
           100 * static_cast<double>(r.inactive) / boxes);
  }
  std::uint64_t in_large = 0;
  for (const Explanation::LargeBox& large : e.largest) in_large += large.cells;
  if (e.boxes > 1000 && static_cast<double>(in_large) > 0.2 * static_cast<double>(e.entries)) {
    advise(e,
           "the %llu largest boxes are %.0f %% of all cell entries: if they need not pair "
           "with each other, "
           "mark them static or give them as a second set",
           static_cast<unsigned long long>(e.largest.size()),
           100 * static_cast<double>(in_large) / static_cast<double>(e.entries));
  }
  if (!e.densest.empty() && e.occupied > 16) {
    const double mean = static_cast<double>(e.entries) / static_cast<double>(e.occupied);
    const double most = static_cast<double>(e.densest.front().boxes);
    if (most > 8 * mean && most > 1024) {
      advise(e,
             "the densest cell holds %.0f boxes where cells with boxes hold %.0f on average; such "
             "a cell is searched by "
             "a grid of its own, which costs about twice as much per box",
             most, mean);
    }
  }
  if (e.tests_per_box > 100 && r.plan.algorithm == Algorithm::grid) {
    advise(e,
           "%.0f tests per box, where 20 to 40 are usual: boxes are long or dense; splitting long "
           "ones helps",
           e.tests_per_box);
  }
  const unsigned offered = base::executor_of(options).concurrency;
  if (r.plan.threads == 1 && offered > 1 && e.boxes >= 10000) {
    advise(e, "one thread of %u was used: Options::threads = 0 takes all", offered);
  }
  if (r.times.order_ms > 0.3 * r.times.total_ms && r.times.total_ms > 0) {
    advise(e,
           "sorting the pairs (canonical order) takes %.0f %% of the time: Order::any leaves it "
           "out",
           100 * r.times.order_ms / r.times.total_ms);
  }
  if (static_cast<double>(r.found) > 32 * boxes && r.found > 1000000) {
    advise(
        e,
        "%.0f pairs per box fill %.0f MB: Finder::consume passes them on in blocks and stores none",
        static_cast<double>(r.found) / boxes, static_cast<double>(r.found) * 8e-6);
  }
  if (e.boxes < 500) {
    advise(
        e,
        "%llu boxes are few: planning and starting take most of the time; several sets can be one "
        "call, each a world",
        static_cast<unsigned long long>(e.boxes));
  }
}

}  // namespace

Explanation make_explanation(const Boxes& a, const Boxes* b, const Options& options,
                             const Result& result, const grid::Engine& engine) {
  Explanation e;
  e.result = result;
  e.boxes = a.size() + (b ? b->size() : 0);
  const double tests = static_cast<double>(result.comparisons);
  if (result.found > 0) e.tests_per_pair = tests / static_cast<double>(result.found);
  if (e.boxes > 0) e.tests_per_box = tests / static_cast<double>(e.boxes);

  std::vector<Explanation::SizeClass> classes(280);
  const grid::GridPlan* const plan = engine.single_grid_plan();
  if (plan) {
    Occupancy cells(plan->map);
    add_boxes(a, false, options.margin, &cells, e, classes);
    if (b) add_boxes(*b, true, options.margin, &cells, e, classes);
    cells.finish(e);
  } else {
    add_boxes(a, false, options.margin, nullptr, e, classes);
    if (b) add_boxes(*b, true, options.margin, nullptr, e, classes);
  }
  for (int k = 0; k < 280; ++k) {
    Explanation::SizeClass c = classes[static_cast<std::size_t>(k)];
    if (c.boxes == 0) continue;
    c.from = class_begin(k);
    c.below = k == 279 ? c.from : k == 0 ? 0 : class_begin(k + 1);
    c.cells_per_box /= static_cast<double>(c.boxes);
    e.size_classes.push_back(c);
  }
  const bool one_problem = result.plan.expected_ns > 0;  // not one per world
  if (plan || (one_problem && result.plan.algorithm == Algorithm::all_pairs)) {
    for (const grid::Candidate& c : engine.candidates(a, b, options)) {
      Explanation::Candidate& way = e.candidates.emplace_back();
      way.algorithm = c.all_pairs ? Algorithm::all_pairs : Algorithm::grid;
      way.sweep_axis = c.sweep_axis;
      std::copy(c.columns, c.columns + 3, way.columns);
      way.expected_ns = c.expected_ns;
    }
    std::sort(e.candidates.begin(), e.candidates.end(),
              [](const auto& x, const auto& y) { return x.expected_ns < y.expected_ns; });
  }
  engine.report_memory([&](const char* what, std::size_t bytes) {
    e.memory_bytes += bytes;
    if (bytes > 0) e.memory.push_back({what, bytes});
  });
  give_advice(e, options);
  return e;
}

}  // namespace throng
