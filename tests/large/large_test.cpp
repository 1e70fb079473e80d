// Inputs above every size at which the library changes its method: 4,096 pairs of a range of the
// sorted order, 6,000 boxes for several threads, 65,536 boxes of a world for all of them and pairs
// of a bucket, 400,000 rows; with every form of call, number of threads and order, and the smallest
// accepted memory cap. Expected pairs come from one sort and one sweep (support/reference.hpp).
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "support/configs.hpp"
#include "support/counting_resource.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

struct Scene {
  std::string name;
  BoxList boxes;
  std::vector<std::int32_t> world;
  std::vector<std::uint8_t> is_static;
  std::size_t first = 0;  // not 0: two sets; the size of the first
  Algorithm algorithm = Algorithm::automatic;
  Answer answer;

  Boxes part(std::size_t begin, std::size_t end) const {
    Boxes view(boxes.data() + begin, end - begin);
    if (!world.empty()) view.filters.world = {world.data() + begin, end - begin};
    if (!is_static.empty()) view.filters.is_static = {is_static.data() + begin, end - begin};
    return view;
  }
  Boxes one() const { return part(0, first ? first : boxes.size()); }
  Boxes other() const { return part(first, boxes.size()); }
  bool two_sets() const { return first != 0; }
};

// The reference sweep supports neither filters nor two sets: they are applied to its pairs.
void answer(Scene& scene) {
  const std::vector<Item> items = read_items(scene.part(0, scene.boxes.size()), 0);
  const Answer all = swept_pairs(scene.boxes);
  scene.answer.inactive = all.inactive;
  for (const Pair& pair : all.pairs) {
    if (!wanted(items[pair.first], items[pair.second])) continue;
    if (scene.two_sets() && (pair.first >= scene.first || pair.second < scene.first)) continue;
    scene.answer.pairs.push_back(
        {pair.first, pair.second - static_cast<std::uint32_t>(scene.first)});
  }
  std::sort(scene.answer.pairs.begin(), scene.answer.pairs.end());
}

// Boxes in a row, touching if `touch`, and `wide` ones over all of them.
Scene row(std::size_t n, const std::vector<std::size_t>& wide, bool touch) {
  Scene scene;
  scene.name = std::to_string(n) + " in a row, " + std::to_string(wide.size()) + " over all";
  const float side = touch ? 1.0f : 0.5f;
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = static_cast<float>(i);
    scene.boxes.push_back({{at, 0, 0}, {at + side, 1, 1}});
  }
  for (const std::size_t i : wide) scene.boxes[i] = {{-1, 0, 0}, {static_cast<float>(n) + 1, 1, 1}};
  return scene;
}

// Worlds in one place, of very different sizes.
Scene worlds(const std::vector<int>& sizes, Algorithm algorithm, std::uint64_t seed) {
  Scene scene;
  Random random(seed);
  scene.name = std::to_string(sizes.size()) + " worlds, by " + to_string(algorithm);
  scene.algorithm = algorithm;
  for (std::size_t w = 0; w < sizes.size(); ++w) {
    const BoxList boxes = uniform_boxes(sizes[w], seed + w);
    scene.boxes.insert(scene.boxes.end(), boxes.begin(), boxes.end());
    scene.world.resize(scene.boxes.size(), static_cast<std::int32_t>(w));
  }
  // Shuffled, so that a world's boxes are not contiguous.
  for (std::size_t i = scene.boxes.size(); i > 1; --i) {
    const std::size_t j = random.below(static_cast<std::uint32_t>(i));
    std::swap(scene.boxes[i - 1], scene.boxes[j]);
    std::swap(scene.world[i - 1], scene.world[j]);
  }
  return scene;
}

Scene uniform(int n, std::size_t first, std::uint64_t seed) {
  Scene scene;
  scene.name = std::to_string(n) + (first ? " uniform in two sets" : " uniform");
  scene.boxes = uniform_boxes(n, seed);
  for (int i = 0; i < n; i += 1000) std::swap(scene.boxes[i].lower.x, scene.boxes[i].upper.x);
  scene.first = first;
  return scene;
}

enum class Form { grow, exact, short_by_one, consume, concurrent, smallest_cap };
constexpr Form forms[] = {Form::grow,    Form::exact,      Form::short_by_one,
                          Form::consume, Form::concurrent, Form::smallest_cap};
const char* name_of(Form form) {
  constexpr const char* names[] = {"own memory", "a buffer that fits",    "one pair too few",
                                   "a consumer", "a concurrent consumer", "the smallest cap"};
  return names[static_cast<int>(form)];
}

// A consumer that is slow at first and counts calls that overlap another one.
struct SlowConsumer {
  std::vector<Pair> pairs;
  std::mutex mutex;
  std::atomic<int> inside{0};
  std::atomic<std::size_t> overlapped{0}, empty{0}, calls{0};

  bool operator()(const Pair* block, std::size_t count) {
    overlapped += inside.fetch_add(1) != 0;
    empty += count == 0;
    if (calls++ < 200) std::this_thread::sleep_for(std::chrono::microseconds(200));
    {
      const std::lock_guard<std::mutex> lock(mutex);
      pairs.insert(pairs.end(), block, block + count);
    }
    inside.fetch_sub(1);
    return true;
  }
};

class Search {
 public:
  Search(const Scene& scene, Options options) : scene_(scene), options_(options) {
    options_.algorithm = scene.algorithm;
    options_.memory = &memory_;
  }

  void run(Form form) {
    switch (form) {
      case Form::grow: {
        Finder finder(options_);
        const Result r = scene_.two_sets() ? finder.find(scene_.one(), scene_.other())
                                           : finder.find(scene_.one());
        expect(r, to_vector(finder.pairs()));
        return;
      }
      case Form::exact:
      case Form::short_by_one:
        return buffer(form == Form::exact);
      default:
        return consume(form);
    }
  }

 private:
  bool in_order() const { return options_.order == Order::canonical; }

  void expect(const Result& r, const std::vector<Pair>& got) const {
    EXPECT_EQ(r.status, Status::ok) << r.message;
    EXPECT_EQ(r.found, scene_.answer.pairs.size());
    EXPECT_EQ(r.written, scene_.answer.pairs.size());
    EXPECT_EQ(r.inactive, scene_.answer.inactive);
    EXPECT_LE(r.plan.threads, options_.threads);
    if (in_order()) {
      EXPECT_TRUE(std::is_sorted(got.begin(), got.end())) << "not sorted";
    }
    EXPECT_TRUE(same_pairs(got, scene_.answer.pairs));
  }

  void buffer(bool enough) {
    constexpr Pair guard{0x12345678, 0x9abcdef0};
    const std::vector<Pair>& want = scene_.answer.pairs;
    const std::size_t capacity = want.size() - (enough ? 0 : 1);
    std::vector<Pair> out(capacity + 16, guard);
    Finder finder(options_);
    const Result r = scene_.two_sets()
                         ? finder.find(scene_.one(), scene_.other(), out.data(), capacity)
                         : finder.find(scene_.one(), out.data(), capacity);
    for (std::size_t i = capacity; i < out.size(); ++i) ASSERT_EQ(out[i], guard) << "past the end";
    if (enough) {
      out.resize(capacity);
      return expect(r, out);
    }
    EXPECT_EQ(r.status, Status::buffer_too_small);
    EXPECT_EQ(r.found, want.size());
    EXPECT_EQ(r.inactive, scene_.answer.inactive);
    ASSERT_EQ(r.written, in_order() ? 0 : capacity);
    if (in_order()) {
      EXPECT_EQ(std::count(out.begin(), out.end(), guard), static_cast<std::ptrdiff_t>(out.size()));
      return;
    }
    out.resize(capacity);
    std::sort(out.begin(), out.end());
    EXPECT_EQ(std::adjacent_find(out.begin(), out.end()), out.end()) << "a duplicate pair";
    EXPECT_TRUE(std::includes(want.begin(), want.end(), out.begin(), out.end()));
  }

  void consume(Form form) {
    options_.concurrent_consumer = form == Form::concurrent;
    if (form == Form::smallest_cap) options_.memory_cap_bytes = 1;
    for (int refusals = 0;; ++refusals) {
      CountingResource counted;
      options_.memory = &counted;
      Finder finder(options_);
      SlowConsumer taken;
      const Result r = scene_.two_sets() ? finder.consume(scene_.one(), scene_.other(), taken)
                                         : finder.consume(scene_.one(), taken);
      if (form != Form::concurrent) {
        EXPECT_EQ(taken.overlapped, 0u) << "overlapping calls";
      }
      EXPECT_EQ(taken.empty, 0u);
      if (form == Form::smallest_cap) {
        EXPECT_LE(counted.peak(), options_.memory_cap_bytes);
        if (r.status == Status::memory_cap_too_small && refusals < 10) {
          ASSERT_GT(r.bytes_needed, options_.memory_cap_bytes);
          options_.memory_cap_bytes = static_cast<std::size_t>(r.bytes_needed);
          continue;
        }
        EXPECT_GT(refusals, 0) << "a cap of one byte was accepted";
      }
      return expect(r, taken.pairs);
    }
  }

  const Scene& scene_;
  Options options_;
  CountingResource memory_;
};

// Runs this many of the forms of call, drawn; 0: all of them.
void search(Scene scene, std::uint64_t seed, std::size_t form_count = 0) {
  answer(scene);
  ASSERT_GT(scene.answer.pairs.size(), 1000u);
  Random random(seed);
  std::vector<std::pair<Order, Form>> chosen;
  for (const Order order : {Order::any, Order::canonical})
    for (const Form form : forms)
      // In order under the smallest cap each search yields only some thousand pairs.
      if (form != Form::smallest_cap || scene.answer.pairs.size() < 100'000)
        chosen.emplace_back(order, form);
  shuffle(chosen, random);
  if (form_count != 0) chosen.resize(form_count);
  for (const auto& [order, form] : chosen) {
    Options options;
    options.order = order;
    options.threads = random.one_in(4) ? 1 + random.below(3) : 4;
    SCOPED_TRACE(scene.name + ", " + name_of(form) + ", " + std::to_string(options.threads) +
                 " threads" + (order == Order::canonical ? ", sorted" : ""));
    Search(scene, options).run(form);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(Large, BoxOverAllIsSplitRepeatedly) {
  for (const std::size_t at : {0u, 6000u, 19'999u}) search(row(20'000, {at}, false), at);
}

// More pairs of adjacent firsts than fit the smallest cap, for any plan and number of threads: a
// range is split repeatedly.
TEST(Large, ManyPairsOfFewFirstsMinCap) {
  std::vector<std::size_t> first_16, apart;
  for (std::size_t i = 0; i < 16; ++i) first_16.push_back(i);
  for (std::size_t i = 5; i < 16'000; i += 1001) apart.push_back(i);
  for (const auto& wide : {first_16, apart}) {
    Scene scene = row(20'000, wide, false);
    answer(scene);
    for (const unsigned threads : {1u, 4u}) {
      SCOPED_TRACE(scene.name + ", " + std::to_string(threads) + " threads");
      Options options;
      options.order = Order::canonical;
      options.threads = threads;
      Search(scene, options).run(Form::smallest_cap);
    }
  }
}

TEST(Large, RowsWithSomeBoxesOverAll) {
  Random random(5);
  const std::uint32_t n = sanitized ? 100'000 : 400'000;
  std::vector<std::size_t> wide;
  for (int k = 0; k < 5; ++k) wide.push_back(random.below(n));
  search(row(n, wide, true), 1, sanitized ? 4 : 0);
}

// Brute force over some two billion pairs: two forms are enough.
TEST(Large, WorldAboveOneThreadLimit) {
  if (sanitized) GTEST_SKIP() << "takes minutes";
  search(worlds({66'000, 700, 33, 5000, 1}, Algorithm::all_pairs, 3), 2, 2);
}

TEST(Large, WorldsInOnePlace) { search(worlds({66'000, 9000, 12}, Algorithm::grid, 4), 3, 5); }

TEST(Large, StaticBoxesPartitioned) {
  Scene scene = uniform(72'000, 0, 6);
  scene.name += ", most of them static";
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) scene.is_static.push_back(i % 20 != 0);
  search(scene, 4, 5);
}

TEST(Large, OneSet) { search(uniform(80'000, 0, 7), 5, 6); }
TEST(Large, TwoSets) {
  search(uniform(80'000, 40'000, 9), 7, 4);
  search(uniform(80'000, 300, 10), 8, 3);
}

// Repeated, as a race between sorting threads shows only by chance. By buckets, where a few firsts
// have very many seconds; and by lists, where all have many.
TEST(Large, SortedRepeatedlyByManyThreads) {
  Scene lists = uniform(60'000, 300, 10);
  for (std::size_t i = 0; i < lists.first; ++i) lists.boxes[i] = cube(lists.boxes[i].lower, 14);
  for (Scene scene : {row(150'000, {70'001, 90'002, 3, 149'000, 120'000}, true), lists}) {
    answer(scene);
    SCOPED_TRACE(scene.name + ", " + std::to_string(scene.answer.pairs.size()) + " pairs");
    Options options;
    options.order = Order::canonical;
    options.threads = 4;
    Finder finder(options);
    for (int k = 0; k < (sanitized ? 3 : 15); ++k) {
      const Result r =
          scene.two_sets() ? finder.find(scene.one(), scene.other()) : finder.find(scene.one());
      ASSERT_TRUE(r.ok()) << r.message;
      const Pairs pairs = finder.pairs();
      ASSERT_TRUE(std::equal(pairs.begin(), pairs.end(), scene.answer.pairs.begin(),
                             scene.answer.pairs.end()))
          << "wrong pairs or order, iteration " << k;
    }
  }
}

// Two calls of a concurrent consumer run at once: each waits for another one, for a limited time.
TEST(Large, ConcurrentConsumerOverlaps) {
  const BoxList boxes = uniform_boxes(200'000, 3);
  Options options;
  options.threads = 4;
  options.concurrent_consumer = true;
  std::atomic<int> inside{0};
  std::atomic<bool> together{false};
  Finder finder(options);
  const Result r = finder.consume(boxes, [&](const Pair*, std::size_t) {
    if (++inside > 1) together = true;
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    while (!together && std::chrono::steady_clock::now() < until) std::this_thread::yield();
    --inside;
    return together.load();  // one failure suffices
  });
  if (r.plan.threads == 1) GTEST_SKIP() << "only one thread here";
  EXPECT_TRUE(together);
  EXPECT_TRUE(r.ok()) << r.message;
}

}  // namespace
}  // namespace throng::tests
