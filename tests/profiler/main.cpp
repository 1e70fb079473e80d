// The library with profiler ranges: results are correct, and every range that is entered is left.
#include <cstdio>
#include <vector>

#include <throng/throng.hpp>

#if defined(COUNTED)
#include <tracy/Tracy.hpp>
#endif

int main() {
  std::vector<throng::Box> boxes;
  for (int i = 0; i < 40000; ++i) {
    const float x = static_cast<float>(i % 200), y = static_cast<float>(i / 200);
    boxes.push_back({{x, y, 0}, {x + 1.5f, y + 0.5f, 1}});
  }
  throng::Options options;
  options.threads = 2;
  options.order = throng::Order::canonical;
  const std::size_t found = throng::find_pairs(boxes, options).size();
  std::vector<throng::ObjectId> ids(boxes.size());
  throng::BroadPhase broad_phase(options);
  if (!broad_phase.add(boxes, ids.data()).ok() || !broad_phase.update().ok()) return 1;
  std::printf("%zu pairs, %zu live\n", found, broad_phase.pair_count());
  if (found != 200 * 199 || found != broad_phase.pair_count()) return 1;
#if defined(COUNTED)
  std::printf("%ld ranges entered, %ld left\n", zones_entered.load(), zones_left.load());
  if (zones_entered < 5 || zones_entered != zones_left) return 1;
#endif
}
