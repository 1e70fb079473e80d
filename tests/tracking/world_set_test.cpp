// WorldSet against a map of counts.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <vector>

#include "support/random.hpp"
#include "tracking/world_set.hpp"

namespace throng::tests {
namespace {

TEST(WorldSet, MatchesMapOfCounts) {
  constexpr int listed = static_cast<int>(tracking::WorldSet::most);
  for (const int worlds : {1, 3, listed, listed + 1, 2 * listed}) {
    Random random(static_cast<std::uint64_t>(worlds));
    tracking::WorldSet set;
    std::vector<std::int32_t> objects;
    std::map<std::int32_t, int> count;
    int complete = 0;
    for (int step = 0; step < 20000; ++step) {
      // The number of worlds grows, and falls to none again.
      const bool grows = (step / 500) % 2 == 0;
      if (objects.empty() || random.below(10) < (grows ? 7u : 3u)) {
        const std::int32_t world = random.between(0, worlds - 1);
        set.add(world);
        objects.push_back(world);
        ++count[world];
      } else {
        std::swap(objects[random.below(static_cast<std::uint32_t>(objects.size()))],
                  objects.back());
        set.remove(objects.back());
        if (--count[objects.back()] == 0) count.erase(objects.back());
        objects.pop_back();
      }
      ASSERT_EQ(set.objects(), objects.size());
      if (worlds <= listed) {
        ASSERT_TRUE(set.all_listed());
      }
      if (!set.all_listed()) continue;
      ++complete;
      std::set<std::int32_t> want;
      for (const auto& [world, n] : count) want.insert(world);
      ASSERT_EQ(std::set<std::int32_t>(set.begin(), set.end()), want) << "step " << step;
      ASSERT_EQ(static_cast<std::size_t>(set.end() - set.begin()), want.size());
    }
    EXPECT_GT(complete, 1000);
  }
}

}  // namespace
}  // namespace throng::tests
