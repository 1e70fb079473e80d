// Persistent objects across ranks, compared with a model of all objects kept by every rank.
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "mpi/all_ranks.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::mpi {
namespace {

struct Object {
  Box box;
  Filter filter;
  int holder;
};

// All objects, equal on every rank: each rank draws the same random numbers.
struct Model {
  std::map<std::uint64_t, Object> objects;
  std::set<Pair64> pairs;

  std::set<Pair64> now(float margin) const {
    std::vector<Box> boxes;
    std::vector<Filter> filters;
    std::vector<std::uint64_t> ids;
    for (const auto& [id, object] : objects) {
      ids.push_back(id);
      boxes.push_back(object.box);
      filters.push_back(object.filter);
    }
    Boxes view(boxes);
    const std::size_t n = boxes.size(), s = sizeof(Filter);
    if (n != 0) {
      view.filters = {{&filters[0].group, n, s},
                      {&filters[0].mask, n, s},
                      {&filters[0].owner, n, s},
                      {&filters[0].world, n, s},
                      {&filters[0].is_static, n, s}};
    }
    std::set<Pair64> found;
    for (const Pair p : tests::reference_pairs(view, margin).pairs) {
      found.insert({ids[p.first], ids[p.second]});
    }
    return found;
  }
};

class RandomOperations {
 public:
  RandomOperations(std::uint64_t seed, const Settings& settings)
      : random_(seed), settings_(settings), live_(MPI_COMM_WORLD, settings) {}

  void add(int count) {
    for (int k = 0; k < count; ++k) {
      const Object object = {
          some_box(), some_filter(),
          static_cast<int>(random_.below(static_cast<std::uint32_t>(rank_count())))};
      const std::uint64_t id = next_id_ += 1 + (std::uint64_t{random_.below(1000)} << 32);
      model_.objects[id] = object;
      if (object.holder != rank_here()) continue;
      Boxes view(&object.box, 1);
      const Filter& f = object.filter;
      view.filters = {{&f.group, 1}, {&f.mask, 1}, {&f.owner, 1}, {&f.world, 1}, {&f.is_static, 1}};
      const Result r = live_.add(&id, view);
      ASSERT_TRUE(r.ok()) << r.message;
    }
  }

  // Changes each object with probability 1 / one_in: moves it a little or far, sets filters, or
  // removes it.
  void change(std::uint32_t one_in) {
    for (auto it = model_.objects.begin(); it != model_.objects.end();) {
      const std::uint64_t id = it->first;
      Object& object = it->second;
      const bool mine = object.holder == rank_here();
      const std::uint32_t what = random_.one_in(one_in) ? random_.below(8) : 99;
      Result r;
      if (what < 4) {
        const float by = random_.in(-0.5f, 0.5f);
        object.box.lower.x += by;
        object.box.upper.x += by;
      } else if (what < 6) {
        object.box = some_box();
      }
      if (what < 6 && mine) r = live_.move(&id, Boxes(&object.box, 1));
      if (what == 6) {
        object.filter = some_filter();
        const Filter& f = object.filter;
        if (mine) {
          r = live_.set_filters(
              &id, 1,
              {{&f.group, 1}, {&f.mask, 1}, {&f.owner, 1}, {&f.world, 1}, {&f.is_static, 1}});
        }
      }
      if (what == 7 && mine) r = live_.remove(&id, 1);
      ASSERT_TRUE(r.ok()) << r.message;
      it = what == 7 ? model_.objects.erase(it) : std::next(it);
    }
  }

  void check(const std::string& what) {
    const Result r = live_.update();
    ASSERT_TRUE(r.ok()) << what << ": " << r.message;
    const std::set<Pair64> now = model_.now(settings_.search.margin);
    std::vector<Pair64> begun, ended;
    std::set_difference(now.begin(), now.end(), model_.pairs.begin(), model_.pairs.end(),
                        std::back_inserter(begun));
    std::set_difference(model_.pairs.begin(), model_.pairs.end(), now.begin(), now.end(),
                        std::back_inserter(ended));
    const auto reported_begun = from_all(live_.begun()), reported_ended = from_all(live_.ended());
    ASSERT_TRUE(reported_begun == begun)
        << what << ", begun: " << difference(reported_begun, begun);
    ASSERT_TRUE(reported_ended == ended)
        << what << ", ended: " << difference(reported_ended, ended);
    ASSERT_EQ(r.found, now.size()) << what;
    const auto all = from_all(live_.pairs());
    ASSERT_TRUE(all == std::vector<Pair64>(now.begin(), now.end())) << what;
    model_.pairs = now;
    find_holders(what);
  }

  BroadPhase& live() { return live_; }
  std::uint64_t arrived() const { return arrived_; }

 private:
  // Each object must be held by exactly one rank; follows migrations.
  void find_holders(const std::string& what) {
    ASSERT_EQ(sum_over_ranks(live_.object_count()), model_.objects.size()) << what;
    std::vector<int> holders;
    for (const auto& [id, object] : model_.objects)
      holders.push_back(live_.holds(id) ? rank_here() : -1);
    MPI_Allreduce(MPI_IN_PLACE, holders.data(), static_cast<int>(holders.size()), MPI_INT, MPI_MAX,
                  MPI_COMM_WORLD);
    std::size_t k = 0, left = 0;
    for (auto& [id, object] : model_.objects) {
      ASSERT_GE(holders[k], 0) << what;
      if (live_.holds(id)) {
        const Box box = live_.box(id);
        EXPECT_EQ(std::memcmp(&box, &object.box, sizeof box), 0);
      }
      left += object.holder == rank_here() && holders[k] != rank_here();
      object.holder = holders[k++];
    }
    EXPECT_EQ(left, live_.departed_count()) << what;
    arrived_ += live_.arrived_count();
    EXPECT_EQ(sum_over_ranks(live_.arrived_count()), sum_over_ranks(live_.departed_count()));
  }

  Box some_box() {
    if (random_.one_in(25)) {  // some span everything, some are empty
      const float far = random_.one_in(2) ? tests::infinity : 40;
      return random_.one_in(4) ? Box{{1, 1, 1}, {0, 0, 0}} : Box{{-far, -far, 1}, {far, far, 2}};
    }
    return tests::cube(random_.point(-6, 6), random_.in(0.2f, 1.5f));
  }
  Filter some_filter() {
    Filter f;
    if (random_.one_in(2)) return f;
    f.group = 1u << random_.below(3);
    f.mask = 1u + random_.below(7);
    f.owner = random_.between(-1, 5);
    f.world = random_.between(-1, 2);
    f.is_static = random_.one_in(3);
    return f;
  }

  tests::Random random_;
  Settings settings_;
  BroadPhase live_;
  Model model_;
  std::uint64_t next_id_ = 0, arrived_ = 0;
};

TEST(Live, EventsEqualTheModel) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Settings settings = test_settings();
    settings.migrate = seed % 2 != 0;
    settings.tree_send_threshold = seed == 3 ? 1 : 32;
    settings.imbalance = seed >= 2 ? 1.0 : 1.2;  // 1: repartition whenever it might help
    settings.search.margin = seed == 2 ? 0.2f : 0;
    RandomOperations operations(seed, settings);
    ASSERT_NO_FATAL_FAILURE(operations.check("none"));
    ASSERT_NO_FATAL_FAILURE(operations.add(120));
    for (int step = 0; step < 9; ++step) {
      const std::string what = "seed " + std::to_string(seed) + ", step " + std::to_string(step);
      ASSERT_NO_FATAL_FAILURE(operations.check(what));
      ASSERT_NO_FATAL_FAILURE(operations.change(step % 4 == 3 ? 1 : 4));
      ASSERT_NO_FATAL_FAILURE(operations.add(step % 3 == 0 ? 25 : 0));
    }
    const std::uint64_t arrived = sum_over_ranks(operations.arrived());
    EXPECT_EQ(arrived > 0, rank_count() > 1 && settings.migrate);
  }
}

TEST(Live, UnchangedObjectsSendNothing) {
  RandomOperations operations(9, test_settings());
  ASSERT_NO_FATAL_FAILURE(operations.add(200));
  for (int step = 0; step < 6; ++step) ASSERT_NO_FATAL_FAILURE(operations.check("settling"));
  EXPECT_EQ(operations.live().traffic().halo.bytes, 0u);
  EXPECT_EQ(operations.live().traffic().halo.messages, 0u);
}

TEST(Live, RefusesInvalidArguments) {
  BroadPhase live(MPI_COMM_WORLD, test_settings());
  const auto boxes = tests::uniform_boxes(3, 1);
  const std::uint64_t base = 10 * static_cast<std::uint64_t>(rank_here());
  const std::uint64_t ids[] = {base, base + 1, base + 2}, twice[] = {base + 5, base + 5, base + 6};
  EXPECT_EQ(live.add(twice, Boxes(boxes)).status, Status::bad_id);
  EXPECT_EQ(live.object_count(), 0u);
  ASSERT_TRUE(live.add(ids, Boxes(boxes)).ok());
  EXPECT_EQ(live.add(ids, Boxes(boxes)).status, Status::bad_id);
  EXPECT_EQ(live.move(twice, Boxes(boxes)).status, Status::bad_id);
  const std::uint64_t pair[] = {base, base};
  EXPECT_EQ(live.remove(pair, 2).status, Status::bad_id);
  const Box nan = {{0, 0, 0}, {1, std::nanf(""), 1}};
  EXPECT_EQ(live.move(ids, Boxes(&nan, 1)).status, Status::nan_box);
  ASSERT_TRUE(live.update().ok());
  const std::uint64_t found = live.update().found;
  // An id of another rank's object: reported on all ranks, and nothing changes.
  const std::uint64_t taken = 0;
  const bool last = rank_here() == rank_count() - 1 && rank_here() != 0;
  if (last) {
    ASSERT_TRUE(live.add(&taken, Boxes(boxes.data(), 1)).ok());
  }
  if (rank_count() == 1) return;
  Result r = live.update();
  EXPECT_EQ(r.status, Status::ranks_disagree);
  EXPECT_NE(std::string(r.message).find("id 0, given by rank"), std::string::npos) << r.message;
  if (last) {
    ASSERT_TRUE(live.remove(&taken, 1).ok());
  }
  r = live.update();
  EXPECT_TRUE(r.ok()) << r.message;
  EXPECT_EQ(r.found, found);
}

}  // namespace
}  // namespace throng::mpi
