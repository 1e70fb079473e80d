// A search that fails after it has reported some pairs, and is repeated, whole or in halves: each
// pair is written once, for every kind of output.
#include "tests/apps/stream/files.hpp"

#include <atomic>
#include <functional>
#include <optional>

#include <throng/checksum.hpp>

#include "apps/stream/pair_output.hpp"
#include "apps/stream/scratch.hpp"
#include "apps/stream/solver.hpp"
#include "apps/stream/source.hpp"

namespace throng::test {
namespace {

constexpr std::size_t kib = 1024;

// The library's search, except that some calls fail for lack of memory after some pairs.
struct Faults {
  std::size_t from_rows = 0;  // from this many boxes on
  std::uint64_t after = 0;    // at least this many pairs: blocks are not split
  std::uint64_t one_of = 1;   // and not all of them

  std::uint64_t calls = 0, failed = 0, discarded_pairs = 0;

  Result operator()(Finder& finder, const Boxes& a, const Boxes* b, Consumer consumer) {
    const auto run = [&](Consumer to) {
      return b ? finder.consume(a, *b, to) : finder.consume(a, to);
    };
    const std::size_t rows = a.size() + (b ? b->size() : 0);
    if (rows < from_rows || calls++ % one_of != 0) return run(consumer);
    std::atomic<std::uint64_t> reported{0};
    Result r = run([&](const Pair* pairs, std::size_t count) {
      if (reported.load() >= after) return false;
      reported += count;
      return consumer(pairs, count);
    });
    EXPECT_TRUE(r.ok() || r.status == Status::stopped) << r.message;
    r.status = Status::memory_cap_too_small;
    ++failed;
    discarded_pairs += reported;
    return r;
  }
};

class Retry : public StreamTest {
 protected:
  // `run_keys`: the number of pairs sorted at a time; 0: unsorted output. Two frames, as state left
  // by one would show in the next.
  void expect_each_once(const Set& a, const Set* b, std::size_t run_keys, bool to_file,
                        Faults& faults) const {
    stream::FileSource first(write(a, "a"), false);
    std::optional<stream::FileSource> second;
    if (b) second.emplace(write(*b, "b"), false);
    stream::Scratch scratch(folder_.string(), 4 * kib, 16 * kib);
    stream::PairOutput output(to_file ? at("pairs.npy") : "", run_keys, scratch);
    stream::SolverSizes sizes;
    sizes.arena_bytes = 160 * kib;
    sizes.finder_bytes = 64 * kib * kib;
    sizes.sample_rows = 512;
    Options options;
    options.threads = 2;
    stream::Solver solver(
        sizes, options, scratch, output, [](double) {}, std::ref(faults));
    stream::Solver::Problem problem;
    problem.side[0] = &first;
    problem.layout[0] = &first.layout();
    problem.self = !b;
    if (b) {
      problem.side[1] = &*second;
      problem.layout[1] = &second->layout();
    }
    problem.name = "again";

    options.order = Order::canonical;
    Finder finder(options);
    const Result r = b ? finder.find(a.view(), b->view()) : finder.find(a.view());
    ASSERT_TRUE(r.ok()) << r.message;
    const Pairs expected = finder.pairs();
    for (int frame = 0; frame < 2; ++frame) {
      solver.solve_frame(problem);
      const stream::PairTotals totals = output.finish_frame();
      EXPECT_EQ(totals.count, expected.size());
      EXPECT_EQ(totals.checksum, pair_checksum(expected.data(), expected.size()));
    }
    output.finish();
    EXPECT_GT(solver.slabs(), 1u);
    if (!to_file) return;
    std::vector<Pair> found = read_pairs();
    ASSERT_EQ(found.size(), 2 * expected.size());
    for (std::size_t frame = 0; frame < 2; ++frame) {
      const auto begin = found.begin() + static_cast<std::ptrdiff_t>(frame * expected.size());
      const auto end = begin + static_cast<std::ptrdiff_t>(expected.size());
      if (run_keys == 0) std::sort(begin, end);
      EXPECT_TRUE(std::equal(begin, end, expected.begin(), expected.end())) << "frame " << frame;
    }
  }

  // All outputs: count only, written as found, sorted in one run and in many, which are merged more
  // than once.
  void expect_each_once(const Set& a, const Set* b, const Faults& faults) const {
    const struct {
      std::size_t run_keys;
      bool to_file;
    } ways[] = {{0, false}, {0, true}, {1 << 18, true}, {2048, true}};
    for (const auto& way : ways) {
      SCOPED_TRACE(way.run_keys);
      Faults some = faults;
      expect_each_once(a, b, way.run_keys, way.to_file, some);
      EXPECT_GT(some.failed, 1u);
      if (faults.after > 0) {
        EXPECT_GT(some.discarded_pairs, 100u);
      }
    }
  }
};

// Whole slabs fail, and their halves, down to a few hundred boxes.
TEST_F(Retry, InHalves) {
  for (const std::uint64_t after : {0, 300, 1 << 30}) {
    SCOPED_TRACE(after);
    Faults faults;
    faults.from_rows = 900;
    faults.after = after;
    expect_each_once(scene_set("uniform", 14000, 2), nullptr, faults);
  }
}

// A failed search is repeated at once, by an empty Finder, and then succeeds.
TEST_F(Retry, AsAWhole) {
  for (const std::uint64_t one_of : {2, 3}) {
    Faults faults;
    faults.one_of = one_of;
    faults.after = 500;
    expect_each_once(scene_set("pile", 20000), nullptr, faults);
  }
}

TEST_F(Retry, OfTwoSets) {
  Faults faults;
  faults.from_rows = 1200;
  faults.after = 200;
  const Set a = scene_set("uniform", 14000, 4, 5), b = scene_set("uniform", 9000, 4, 6);
  expect_each_once(a, &b, faults);
}

// Wide boxes are compared with slabs as halo rows; those in one place are processed in blocks.
TEST_F(Retry, OfHalosAndBlocks) {
  Faults faults;
  faults.from_rows = 1500;
  faults.after = 100;
  Set set = scene_set("uniform", 12000, 1);
  for (std::size_t i = 0; i < set.boxes.size(); i += 40) set.boxes[i].upper.x += 1e4f;
  expect_each_once(set, nullptr, faults);
  Set one_place;
  for (int i = 0; i < 6500; ++i) {
    one_place.boxes.push_back({{0, 0, 0}, {1, 1, 1}});
    one_place.world.push_back(i % 600);
  }
  faults.from_rows = 3000;
  stream::FileSource source(write(one_place, "place"), false);
  EXPECT_GT(source.count() * source.layout().bytes, 160 * kib);
  expect_each_once(one_place, nullptr, faults);
}

}  // namespace
}  // namespace throng::test
