#include "apps/figures/motion.hpp"

#include <map>

namespace throng::figures {
namespace {

std::vector<Mover> make_movers(int count, int area_width, int area_height) {
  constexpr int edge = 60;
  Random random;
  std::vector<Mover> movers;
  for (int i = 0; i < count; ++i) {
    // Some large and slow, many small.
    const bool large = i % 8 == 0;
    Mover m{};
    m.width = random.within(large ? 900 : 260, large ? 1300 : 560);
    m.height = random.within(large ? 500 : 260, large ? 800 : 560);
    m.x.laps = i % 4 == 1 ? 2 : 1;
    m.y.laps = large ? 1 : 1 << random.within(0, 2);
    m.x.phase = random.within(0, tick_count);
    m.y.phase = random.within(0, tick_count);
    m.x.from = m.y.from = edge;
    m.x.length = 10 * area_width - 2 * edge - m.width;
    m.y.length = 10 * area_height - 2 * edge - m.height;
    movers.push_back(m);
  }
  return movers;
}

}  // namespace

Motion motion(int count, int area_width, int area_height) {
  Motion made{make_movers(count, area_width, area_height), {}};
  Options options;
  options.threads = 1;
  BroadPhase broad_phase(options);
  std::vector<ObjectId> ids;
  for (const Mover& mover : made.movers) ids.push_back(broad_phase.add(mover.box(0)));
  std::map<std::pair<ObjectId, ObjectId>, int> began;
  for (int tick = 0; tick <= tick_count; ++tick) {
    for (const ObjectId id : ids) broad_phase.move(id, made.movers[id].box(tick));
    const Result result = broad_phase.update();
    if (!result.ok()) throw Error(result);
    for (const LivePair& p : broad_phase.begun()) began[{p.first, p.second}] = tick;
    for (const LivePair& p : broad_phase.ended()) {
      const auto found = began.find({p.first, p.second});
      made.intervals.push_back({p.first, p.second, found->second, tick});
      began.erase(found);
    }
  }
  for (const auto& [pair, tick] : began) {
    if (tick < tick_count) made.intervals.push_back({pair.first, pair.second, tick, tick_count});
  }
  return made;
}

}  // namespace throng::figures
