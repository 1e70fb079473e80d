// The search across ranks compared with the brute-force reference, for several distributions of the
// boxes.
#include <cfenv>
#include <cmath>

#include <throng/find_pairs.hpp>

#include "apps/scenes/scene.hpp"
#include "mpi/all_ranks.hpp"
#include "mpi/minimum_copies.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::mpi {
namespace {

scenes::Scene scene_of(const std::string& name, std::size_t objects) {
  scenes::Spec spec;
  spec.name = name;
  spec.objects = objects;
  return scenes::Scene(spec);
}
std::vector<Box> boxes_of(const scenes::Scene& scene) {
  std::vector<Box> boxes(scene.size());
  scene.frame(0, boxes.data());
  return boxes;
}

// The initial distribution of the boxes.
enum class Distribution { slices, one_rank, shuffled, not_the_last };
constexpr Distribution distributions[] = {Distribution::slices, Distribution::one_rank,
                                          Distribution::shuffled, Distribution::not_the_last};

int holder(Distribution distribution, std::size_t i, std::size_t n) {
  const auto ranks = static_cast<std::size_t>(rank_count());
  switch (distribution) {
    case Distribution::slices:
      return static_cast<int>(i * ranks / n);
    case Distribution::one_rank:
      return rank_count() / 2;
    case Distribution::shuffled:
      return static_cast<int>(i * 2654435761u % 1000003u % ranks);
    case Distribution::not_the_last:
      return static_cast<int>(i % std::max<std::size_t>(1, ranks - 1));
  }
  return 0;
}

struct LocalBoxes {
  std::vector<Box> boxes;
  std::vector<std::uint64_t> ids;

  LocalBoxes(const std::vector<Box>& all, Distribution distribution, std::uint64_t first = 0,
             std::uint64_t step = 1) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (holder(distribution, i, all.size()) != rank_here()) continue;
      boxes.push_back(all[i]);
      ids.push_back(first + step * i);
    }
  }
  RankBoxes view() const { return {Boxes(boxes), ids.data()}; }
};

template <class SomeFinder>
void expect_pairs(SomeFinder& finder, const RankBoxes& mine, const std::vector<Pair64>& wanted,
                  const std::string& what) {
  const Result r = finder.find(mine);
  ASSERT_TRUE(r.ok()) << what << ": " << r.message;
  EXPECT_EQ(r.found, wanted.size()) << what;
  EXPECT_EQ(r.written, finder.pairs().size());
  const std::vector<Pair64> found = from_all(finder.pairs());
  EXPECT_TRUE(found == wanted) << what << ": " << difference(found, wanted);
}

TYPED_TEST_SUITE(AnyFinder, Finders, FinderNames);

TYPED_TEST(AnyFinder, EqualsBruteForce) {
  // One finder forwards every box that overlaps two regions along the tree; the other repartitions
  // for each scene, while the first keeps a partition of an earlier scene.
  Settings settings[2] = {test_settings(), test_settings()};
  settings[0].tree_send_threshold = 1;
  settings[1].imbalance = 1;
  TypeParam finders[2] = {TypeParam(MPI_COMM_WORLD, settings[0]),
                          TypeParam(MPI_COMM_WORLD, settings[1])};
  std::size_t scene_index = 0;
  for (const tests::HardScene& scene : tests::hard_scenes(200)) {
    const auto wanted = widened(tests::reference_pairs(scene.boxes).pairs);
    const LocalBoxes mine(scene.boxes, distributions[scene_index / 2 % 4]);
    ASSERT_NO_FATAL_FAILURE(
        expect_pairs(finders[scene_index++ % 2], mine.view(), wanted, scene.name));
  }
}

TYPED_TEST(AnyFinder, EqualsASingleRank) {
  Settings settings = test_settings();
  settings.imbalance = 1;  // repartition whenever it might help
  TypeParam finder(MPI_COMM_WORLD, settings);
  std::size_t scene_index = 0;
  for (const std::string& name : scenes::names()) {
    const std::vector<Box> boxes = boxes_of(scene_of(name, 1500));
    const auto wanted = widened(find_pairs(Boxes(boxes)));
    const LocalBoxes mine(boxes, distributions[scene_index++ % 4]);
    ASSERT_NO_FATAL_FAILURE(expect_pairs(finder, mine.view(), wanted, name));
  }
}

TYPED_TEST(AnyFinder, AppliesMarginAndFilters) {
  Settings settings = test_settings();
  settings.search.margin = 0.3f;
  TypeParam finder(MPI_COMM_WORLD, settings);
  std::size_t scene_index = 0;
  for (const tests::HardScene& scene : tests::hard_scenes(120)) {
    if (scene_index++ % 4 != 0) continue;
    const std::size_t n = scene.boxes.size();
    std::vector<std::uint32_t> group(n), mask(n);
    std::vector<std::int32_t> owner(n), world(n);
    std::vector<std::uint8_t> fixed(n);
    for (std::size_t i = 0; i < n; ++i) {
      group[i] = 1u << (i % 3);
      mask[i] = i % 5 == 0 ? 1u : 7u;
      owner[i] = static_cast<std::int32_t>(i % 11) - 1;
      world[i] = static_cast<std::int32_t>(i % 4) - 1;
      fixed[i] = i % 6 == 0;
    }
    Boxes all(scene.boxes);
    all.filters = {{group.data(), n},
                   {mask.data(), n},
                   {owner.data(), n},
                   {world.data(), n},
                   {fixed.data(), n}};
    // Slices, and only even ranks give filters; a missing filter allows all.
    const std::size_t ranks = static_cast<std::size_t>(rank_count());
    const std::size_t rank = static_cast<std::size_t>(rank_here());
    const std::size_t begin = n * rank / ranks, end = n * (rank + 1) / ranks;
    for (std::size_t r = 1; r < ranks; r += 2) {
      for (std::size_t i = n * r / ranks; i < n * (r + 1) / ranks; ++i) {
        group[i] = mask[i] = 0xffffffffu;
        owner[i] = world[i] = -1;
        fixed[i] = 0;
      }
    }
    RankBoxes mine{Boxes(scene.boxes.data() + begin, end - begin), nullptr};
    if (rank % 2 == 0) {
      const std::size_t m = end - begin;
      mine.boxes.filters = {{group.data() + begin, m},
                            {mask.data() + begin, m},
                            {owner.data() + begin, m},
                            {world.data() + begin, m},
                            {fixed.data() + begin, m}};
    }
    const auto wanted = widened(tests::reference_pairs(all, 0.3f).pairs);
    ASSERT_NO_FATAL_FAILURE(expect_pairs(finder, mine, wanted, scene.name));
  }
}

TYPED_TEST(AnyFinder, FindsPairsOfTwoSets) {
  const auto a = tests::uniform_boxes(300, 5), b = tests::huge_among_small(200, 6);
  TypeParam finder(MPI_COMM_WORLD, test_settings());
  const LocalBoxes mine_a(a, Distribution::shuffled, 1000), mine_b(b, Distribution::one_rank, 500);
  const Result r = finder.find(mine_a.view(), mine_b.view());
  ASSERT_TRUE(r.ok()) << r.message;
  std::vector<Pair64> wanted;
  for (const Pair pair : tests::reference_pairs(Boxes(a), Boxes(b)).pairs) {
    wanted.push_back({1000u + pair.first, 500u + pair.second});
  }
  std::sort(wanted.begin(), wanted.end());
  EXPECT_TRUE(from_all(finder.pairs()) == wanted) << difference(from_all(finder.pairs()), wanted);
}

TYPED_TEST(AnyFinder, CountsInactiveBoxes) {
  auto a = tests::uniform_boxes(200, 21);
  const auto b = tests::uniform_boxes(100, 22);
  for (std::size_t i = 0; i < a.size(); i += 10) a[i].upper.z = std::nanf("");
  for (std::size_t i = 5; i < a.size(); i += 20) std::swap(a[i].lower.x, a[i].upper.x);
  Settings settings = test_settings();
  settings.search.nan = NanPolicy::inactive;
  TypeParam finder(MPI_COMM_WORLD, settings);
  const LocalBoxes mine_a(a, Distribution::shuffled), mine_b(b, Distribution::slices);
  for (int frame = 0; frame < 2; ++frame) {
    const Result one = finder.find(mine_a.view());
    ASSERT_TRUE(one.ok()) << one.message;
    EXPECT_EQ(one.inactive, 30u);
    const auto wanted = widened(tests::reference_pairs(Boxes(a)).pairs);
    EXPECT_TRUE(from_all(finder.pairs()) == wanted) << difference(from_all(finder.pairs()), wanted);
    const Result two = finder.find(mine_b.view(), mine_a.view());
    ASSERT_TRUE(two.ok()) << two.message;
    EXPECT_EQ(two.inactive, 30u);
    EXPECT_EQ(two.found, from_all(finder.pairs()).size());
  }
}

TYPED_TEST(AnyFinder, SortsPairsOf64BitIds) {
  const auto boxes = tests::uniform_boxes(300, 7);
  const std::uint64_t first = std::uint64_t{1} << 63, step = std::uint64_t{0} - 1000003;
  Settings settings = test_settings();
  settings.search.order = Order::canonical;
  TypeParam finder(MPI_COMM_WORLD, settings);
  const LocalBoxes mine(boxes, Distribution::shuffled, first, step);
  std::vector<Pair64> wanted;
  for (const Pair pair : tests::reference_pairs(Boxes(boxes)).pairs) {
    const std::uint64_t one = first + step * pair.first, two = first + step * pair.second;
    wanted.push_back({std::min(one, two), std::max(one, two)});
  }
  std::sort(wanted.begin(), wanted.end());
  ASSERT_NO_FATAL_FAILURE(expect_pairs(finder, mine.view(), wanted, "large ids"));
  const Pairs64 reported = finder.pairs();
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
}

TYPED_TEST(AnyFinder, AcceptsNoBoxesAndTeleports) {
  TypeParam finder(MPI_COMM_WORLD, test_settings());
  ASSERT_NO_FATAL_FAILURE(expect_pairs(finder, {}, {}, "none"));
  auto boxes = tests::uniform_boxes(400, 9);
  for (int frame = 0; frame < 4; ++frame) {
    const LocalBoxes mine(boxes, distributions[frame]);
    const auto wanted = widened(tests::reference_pairs(Boxes(boxes)).pairs);
    ASSERT_NO_FATAL_FAILURE(expect_pairs(finder, mine.view(), wanted, "teleport"));
    for (Box& box : boxes) {
      const float far = frame % 2 ? -977.0f : 1013.0f;
      box = {{box.lower.z + far, box.lower.x, box.lower.y},
             {box.upper.z + far, box.upper.x, box.upper.y}};
    }
  }
}

// With clusters far apart a region is searched in parts; boxes that cross parts, and filters, must
// not change the result.
TEST(Finder, SearchesARegionInParts) {
  const scenes::Scene scene = scene_of("clusters", 9000);
  std::vector<Box> boxes = boxes_of(scene);
  std::vector<std::int32_t> owner(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) owner[i] = static_cast<std::int32_t>(i / 100 % 7);
  for (int rod_density = 0; rod_density < 3; ++rod_density) {
    // Rods from cluster to cluster, many or few, so that the sample may miss them.
    for (std::size_t i = 1; rod_density && i < boxes.size(); i += rod_density == 1 ? 900 : 50) {
      boxes[i].upper.y += static_cast<float>(scene.side()) * (i % 2 == 0 ? 0.3f : 2.0f);
    }
    Settings settings = test_settings();
    settings.parts = true;
    settings.search.margin = rod_density == 2 ? 0.25f : 0.0f;
    // Boxes [begin, end), and this rank's slice of them.
    const auto part = [&](std::size_t begin, std::size_t end, bool owners) {
      Boxes view(boxes.data() + begin, end - begin);
      if (owners) view.filters.owner = {owner.data() + begin, end - begin};
      return view;
    };
    const auto slice = [&](std::size_t begin, std::size_t end, bool owners) {
      const auto ranks = static_cast<std::size_t>(rank_count());
      const auto rank = static_cast<std::size_t>(rank_here());
      const std::size_t n = end - begin;
      return part(begin + n * rank / ranks, begin + n * (rank + 1) / ranks, owners);
    };
    Options options;
    options.margin = settings.search.margin;
    Finder finder(MPI_COMM_WORLD, settings);
    const std::size_t n = boxes.size();
    const auto expect = [&](const Result& r, const std::vector<Pair64>& wanted, const char* what) {
      ASSERT_TRUE(r.ok()) << what << ": " << r.message;
      const std::vector<Pair64> found = from_all(finder.pairs());
      EXPECT_TRUE(found == wanted) << what << ": " << difference(found, wanted);
    };
    for (const bool owners : {false, true}) {
      const auto wanted = widened(find_pairs(part(0, n, owners), options));
      expect(finder.find({slice(0, n, owners), nullptr}), wanted, "one set");
      if (rod_density == 0) {
        EXPECT_GT(finder.traffic().parts, 1u);
      }
    }
    expect(finder.find({slice(0, 6000, true), nullptr}, {slice(6000, n, true), nullptr}),
           widened(find_pairs(part(0, 6000, true), part(6000, n, true), options)), "two sets");
  }
}

// A GPU search uses a single part, since each call has an overhead.
TEST(Finder, DoesNotSplitARegionOnAGpu) {
  const std::vector<Box> boxes = boxes_of(scene_of("clusters", 4000));
  Settings settings = test_settings();
  settings.parts = true;
  settings.search.backend = Backend::emulated;
  Finder finder(MPI_COMM_WORLD, settings);
  ASSERT_NO_FATAL_FAILURE(expect_pairs(finder, LocalBoxes(boxes, Distribution::slices).view(),
                                       widened(find_pairs(Boxes(boxes))), "emulated"));
  EXPECT_EQ(finder.traffic().parts, 1u);
}

// A box that overlaps all regions is forwarded along the tree: its owner sends one message per
// level.
TYPED_TEST(AnyFinder, ForwardsLargeBoxesAlongTheTree) {
  auto boxes = tests::uniform_boxes(500, 11);
  const float far = tests::infinity;
  boxes[0] = {{-far, -far, -far}, {far, far, far}};
  boxes[1] = {{-1e6f, -1e6f, 2}, {1e6f, 1e6f, 3}};
  Settings settings = test_settings();
  settings.tree_send_threshold = 1;
  TypeParam finder(MPI_COMM_WORLD, settings);
  const LocalBoxes mine(boxes, Distribution::slices);
  const auto wanted = widened(tests::reference_pairs(Boxes(boxes)).pairs);
  ASSERT_NO_FATAL_FAILURE(expect_pairs(finder, mine.view(), wanted, "spanning"));
  EXPECT_EQ(sum_over_ranks(finder.traffic().wide) >= 2, rank_count() > 1);
}

// The caller's floating-point state has no effect, even if it differs between ranks.
TYPED_TEST(AnyFinder, IgnoresCallersFloatState) {
  const auto boxes = tests::denormal_boxes(400, 12);
  const auto wanted = widened(tests::reference_pairs(Boxes(boxes), 1e-41f).pairs);
  Settings settings = test_settings();
  settings.search.margin = 1e-41f;
  const LocalBoxes mine(boxes, Distribution::shuffled);
  const int modes[] = {FE_DOWNWARD, FE_UPWARD, FE_TOWARDZERO, FE_TONEAREST};
  std::fesetround(modes[rank_here() % 4]);
#ifdef __SSE__
  const unsigned state = __builtin_ia32_stmxcsr();
  if (rank_here() % 2 == 0)
    __builtin_ia32_ldmxcsr(state | 0x8040);  // flush-to-zero and denormals-are-zero
#endif
  TypeParam finder(MPI_COMM_WORLD, settings);
  const Result r = finder.find(mine.view());
#ifdef __SSE__
  __builtin_ia32_ldmxcsr(state);
#endif
  std::fesetround(FE_TONEAREST);
  ASSERT_TRUE(r.ok()) << r.message;
  const auto found = from_all(finder.pairs());
  EXPECT_TRUE(found == wanted) << difference(found, wanted);
}

// On a GPU the storage order within a cell varies, so counted work and cuts may differ slightly.
template <class Finder>
void expect_same_counts(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b) {
  if constexpr (std::is_same_v<Finder, GpuFinder>) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k)
      EXPECT_NEAR(static_cast<double>(a[k]), static_cast<double>(b[k]),
                  0.05 * static_cast<double>(a[k]))
          << k;
  } else {
    EXPECT_EQ(a, b);
  }
}

// Counted work is reproducible, and its imbalance is below the threshold for uneven scenes.
TYPED_TEST(AnyFinder, IsBalancedAndReproducible) {
  for (const char* name : {"clusters", "pile", "uniform"}) {
    const std::vector<Box> boxes = boxes_of(scene_of(name, 12000));
    std::vector<std::uint64_t> work[2];
    double imbalance = 9;
    for (auto& run : work) {
      if (&run == &work[1] && std::string(name) != "clusters") continue;
      Settings settings = test_settings();
      settings.imbalance = 1.05;
      settings.search.algorithm = Algorithm::grid;  // a device uses brute force for so few boxes
      TypeParam finder(MPI_COMM_WORLD, settings);
      const LocalBoxes mine(boxes, Distribution::slices);
      for (int frame = 0; frame < 4; ++frame) {
        ASSERT_TRUE(finder.find(mine.view()).ok());
        run.push_back(finder.traffic().work);
        run.push_back(finder.traffic().halo.bytes);
        imbalance = finder.traffic().imbalance;
      }
    }
    if (!work[1].empty()) {
      expect_same_counts<TypeParam>(work[0], work[1]);
    }
    EXPECT_LT(imbalance, 1.1) << name;
  }
}

// If each rank holds the boxes it owns, only boxes that cross a cut are sent.
TYPED_TEST(AnyFinder, SendsNearlyTheMinimum) {
  const scenes::Scene scene = scene_of("uniform", 20000);
  std::vector<Box> boxes = boxes_of(scene);
  Settings settings = test_settings();
  settings.imbalance = 1e9;  // keep the first partition
  TypeParam finder(MPI_COMM_WORLD, settings);
  ASSERT_TRUE(finder.find(LocalBoxes(boxes, Distribution::slices).view()).ok());
  std::vector<Box> mine;
  std::vector<std::uint64_t> ids;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (finder.home(boxes[i]) != rank_here()) continue;
    mine.push_back(boxes[i]);
    ids.push_back(i);
  }
  ASSERT_TRUE(finder.find({Boxes(mine), ids.data()}).ok());
  const double least = 20000 * minimum_copies(rank_count(), scene.side());
  const double bytes = static_cast<double>(sum_over_ranks(finder.traffic().halo.bytes));
  EXPECT_LE(bytes, 1.3 * 32 * least);
  EXPECT_EQ(finder.traffic().home, mine.size());
}

}  // namespace
}  // namespace throng::mpi
