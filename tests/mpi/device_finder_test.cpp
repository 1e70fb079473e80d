// Properties specific to DeviceFinder: device, buffers, memory. Results and failures are tested
// together with Finder: finder_test.cpp, failures_test.cpp.
#include <memory_resource>
#include <new>

#include "mpi/all_ranks.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::mpi {
namespace {

bool is_last() { return rank_here() == rank_count() - 1; }

Settings emulated(Buffers buffers = Buffers::automatic) {
  Settings settings = test_settings();
  settings.search.backend = Backend::emulated;
  settings.buffers = buffers;
  return settings;
}

// An equal share of these boxes per rank, numbered consecutively.
struct Slice {
  const Box* boxes;
  std::size_t count;

  explicit Slice(const std::vector<Box>& all) {
    const auto ranks = static_cast<std::size_t>(rank_count());
    const auto rank = static_cast<std::size_t>(rank_here());
    boxes = all.data() + all.size() * rank / ranks;
    count = all.size() * (rank + 1) / ranks - all.size() * rank / ranks;
  }
  RankBoxes view() const { return {Boxes(boxes, count), nullptr}; }
};

TEST(DeviceFinder, RanksMayUseDifferentBuffers) {
  const auto boxes = tests::uniform_boxes(500, 31);
  const auto wanted = widened(tests::reference_pairs(Boxes(boxes)).pairs);
  for (const bool last_is_direct : {false, true}) {
    const bool direct = is_last() == last_is_direct;
    DeviceFinder finder(MPI_COMM_WORLD, emulated(direct ? Buffers::direct : Buffers::staged));
    EXPECT_TRUE(finder.pairs().empty());
    for (int frame = 0; frame < 3; ++frame) {
      const Result r = finder.find(Slice(boxes).view(), nullptr);
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_EQ(r.plan.backend, Backend::emulated);
      EXPECT_EQ(finder.traffic().direct, direct);
      const auto found = from_all(finder.pairs());
      EXPECT_TRUE(found == wanted) << difference(found, wanted);
    }
  }
  DeviceFinder finder(MPI_COMM_WORLD, emulated());
  ASSERT_TRUE(finder.find(Slice(boxes).view(), nullptr).ok());
  EXPECT_TRUE(finder.traffic().direct) << "MPI accepts host memory";
}

// With one filter or three the record size is not a multiple of eight bytes.
TEST(DeviceFinder, AcceptsStridesAndAnyFilters) {
  struct Body {
    std::uint32_t group;
    float lower[3];
    std::int32_t world;
    float upper[3];
    std::uint8_t fixed;
  };
  const auto boxes = tests::uniform_boxes(400, 32);
  std::vector<Body> all(boxes.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Box& b = boxes[i];
    all[i] = {i % 3 == 0 ? 1u : 3u,
              {b.lower.x, b.lower.y, b.lower.z},
              static_cast<std::int32_t>(i % 4) - 1,
              {b.upper.x, b.upper.y, b.upper.z},
              static_cast<std::uint8_t>(i % 2 ? 0 : 128)};
  }
  const auto view = [](const std::vector<Body>& v, unsigned filters) {
    const Body* p = v.data();
    const std::size_t n = v.size();
    Boxes seen = Boxes::arrays(p->lower, p->lower + 1, p->lower + 2, p->upper, p->upper + 1,
                               p->upper + 2, n, sizeof(Body));
    if (filters & 1) seen.filters.group = {&p->group, n, sizeof(Body)};
    if (filters & 2) seen.filters.world = {&p->world, n, sizeof(Body)};
    if (filters & 4) seen.filters.is_static = {&p->fixed, n, sizeof(Body)};
    return seen;
  };
  DeviceFinder finder(MPI_COMM_WORLD, emulated());
  for (const unsigned filters : {1u, 4u, 7u, 0u, 6u}) {
    std::vector<Body> mine;
    std::vector<std::uint64_t> ids;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (static_cast<int>(i) % rank_count() != rank_here()) continue;
      mine.push_back(all[i]);
      ids.push_back(i);
    }
    const Result r = finder.find({view(mine, filters), ids.data()}, nullptr);
    ASSERT_TRUE(r.ok()) << r.message;
    const auto wanted = widened(tests::reference_pairs(view(all, filters)).pairs);
    const auto found = from_all(finder.pairs());
    EXPECT_TRUE(found == wanted) << filters << ": " << difference(found, wanted);
  }
}

TEST(DeviceFinder, WithoutADeviceFailsOnAllRanks) {
  const auto boxes = tests::uniform_boxes(50, 33);
  Settings settings = emulated();
  if (is_last()) settings.search.backend = Backend::cpu;
  DeviceFinder finder(MPI_COMM_WORLD, settings);
  const Result r = finder.find(Slice(boxes).view(), nullptr);
  EXPECT_EQ(r.status, Status::bad_option);
  EXPECT_NE(std::string(r.message).find("the backend is cpu"), std::string::npos) << r.message;
  EXPECT_EQ(finder.pairs().size(), 0u);
  if (cuda::available().ok()) return;
  if (is_last()) settings.search.backend = Backend::cuda;
  DeviceFinder second(MPI_COMM_WORLD, settings);
  const std::string last = "rank " + std::to_string(rank_count() - 1) + ": ";
  for (int call = 0; call < 2; ++call) {
    const Result none = second.find(Slice(boxes).view(), Slice(boxes).view(), nullptr);
    EXPECT_EQ(none.status, Status::no_device) << none.message;
    EXPECT_EQ(std::string(none.message).rfind(last, 0), 0u) << none.message;
  }
}

// A resource that succeeds a given number of times, then fails.
class LimitedMemory : public std::pmr::memory_resource {
 public:
  int left = 0;
  std::size_t held = 0;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (left-- <= 0) throw std::bad_alloc();
    held += bytes;
    return std::pmr::new_delete_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* p, std::size_t bytes, std::size_t alignment) override {
    held -= bytes;
    std::pmr::new_delete_resource()->deallocate(p, bytes, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

// If an allocation fails on one rank, all ranks report it without waiting, and the next call
// succeeds.
TEST(DeviceFinder, OutOfMemoryFailsOnAllAndRecovers) {
  auto boxes = tests::uniform_boxes(300, 34);
  boxes[7] = {{-1e6f, -1e6f, 2}, {1e6f, 1e6f, 3}};
  const auto wanted = widened(tests::reference_pairs(Boxes(boxes)).pairs);
  LimitedMemory limited_memory;
  int failed = 0;
  for (const Buffers buffers : {Buffers::direct, Buffers::staged}) {
    bool all_found = false;
    for (int count = 0; !all_found && count < 100; ++count) {
      Settings settings = emulated(buffers);
      settings.tree_send_threshold = 1;
      settings.search.memory = &limited_memory;
      settings.search.order = Order::canonical;
      DeviceFinder finder(MPI_COMM_WORLD, settings);
      limited_memory.left = is_last() ? count : 1000000;
      const Result r = finder.find(Slice(boxes).view(), nullptr);
      all_found = r.ok();
      if (!all_found) {
        ++failed;
        ASSERT_EQ(r.status, Status::out_of_memory) << r.message;
        EXPECT_TRUE(finder.pairs().empty());
        EXPECT_EQ(std::string(r.message).rfind("rank ", 0), 0u) << r.message;
      }
      limited_memory.left = 1000000;
      const Result again = finder.find(Slice(boxes).view(), nullptr);
      ASSERT_TRUE(again.ok()) << again.message;
      const auto found = from_all(finder.pairs());
      ASSERT_TRUE(found == wanted) << count << ": " << difference(found, wanted);
    }
    EXPECT_TRUE(all_found);
  }
  EXPECT_GT(failed, 16);
  EXPECT_EQ(limited_memory.held, 0u);
}

TEST(DeviceFinder, SameSizeAllocatesNothing) {
  const auto boxes = tests::uniform_boxes(600, 35);
  LimitedMemory limited_memory;
  Settings settings = emulated();
  settings.search.memory = &limited_memory;
  settings.imbalance = 1e9;  // keep the partition
  DeviceFinder finder(MPI_COMM_WORLD, settings);
  for (int frame = 0; frame < 4; ++frame) {
    limited_memory.left = frame < 2 ? 1000000 : 0;
    const Result r = finder.find(Slice(boxes).view(), Slice(boxes).view(), nullptr);
    ASSERT_TRUE(r.ok()) << frame << ": " << r.message;
  }
}

TEST(DeviceFinder, CanBeMoved) {
  const auto boxes = tests::uniform_boxes(100, 36);
  DeviceFinder first(MPI_COMM_WORLD, emulated());
  const Result r = first.find(Slice(boxes).view(), nullptr);
  ASSERT_TRUE(r.ok()) << r.message;
  const std::size_t reported = first.pairs().size();
  DeviceFinder second(std::move(first));
  EXPECT_EQ(second.pairs().size(), reported);
  EXPECT_EQ(second.find(Slice(boxes).view(), nullptr).found, r.found);
}

}  // namespace
}  // namespace throng::mpi
