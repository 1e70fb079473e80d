// A failure on one rank is reported on all, with the same message and in bounded time.
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <thread>

#include "mpi/all_ranks.hpp"
#include "support/hard_boxes.hpp"

namespace throng::mpi {
namespace {

bool is_last() { return rank_here() == rank_count() - 1; }

// Checks for the same status and message on every rank, and that the message contains `expected`.
void expect_failure(const Result& r, Status status, const std::string& expected) {
  EXPECT_EQ(r.status, status) << r.message;
  EXPECT_NE(std::string(r.message).find(expected), std::string::npos)
      << "no '" << expected << "' in: " << r.message;
  char first[sizeof r.message];
  std::memcpy(first, r.message, sizeof first);
  MPI_Bcast(first, sizeof first, MPI_CHAR, 0, MPI_COMM_WORLD);
  EXPECT_STREQ(first, r.message);
}

std::string last() { return "rank " + std::to_string(rank_count() - 1) + ": "; }

template <class T>
class Failures : public AnyFinder<T> {};
TYPED_TEST_SUITE(Failures, Finders, FinderNames);

TYPED_TEST(Failures, InvalidBoxesOnOneRankFailOnAll) {
  auto boxes = tests::uniform_boxes(50, 1);
  TypeParam finder(MPI_COMM_WORLD, test_settings());
  const std::vector<Box> good = boxes;
  boxes[17].upper.y = std::nanf("");
  expect_failure(finder.find({Boxes(is_last() ? boxes : good), nullptr}), Status::nan_box,
                 last() + "1 boxes have a NaN, the first is its box 17");
  std::vector<std::int32_t> worlds(50, -1);
  if (is_last()) worlds[3] = -2;
  RankBoxes mine{Boxes(good), nullptr};
  mine.boxes.filters.world = {worlds.data(), worlds.size()};
  expect_failure(finder.find(mine), Status::bad_filter, last() + "1 boxes have a world below -1");
  if (is_last()) mine.boxes.filters.world.count = 49;
  expect_failure(finder.find(mine), Status::bad_filter, "49 values for 50 boxes");
  EXPECT_TRUE(finder.find({Boxes(good), nullptr}).ok());
}

TYPED_TEST(Failures, DifferentOptionsAreNamed) {
  if (rank_count() == 1) GTEST_SKIP() << "needs two ranks";
  const auto boxes = tests::uniform_boxes(20, 2);
  Settings settings = test_settings();
  settings.search.margin = is_last() ? 0.5f : 0.25f;
  TypeParam finder(MPI_COMM_WORLD, settings);
  expect_failure(finder.find({Boxes(boxes), nullptr}), Status::ranks_disagree,
                 "disagree on the margin: from 0.25 to 0.5");
  settings = test_settings();
  settings.search.nan = is_last() ? NanPolicy::inactive : NanPolicy::refuse;
  TypeParam other(MPI_COMM_WORLD, settings);
  expect_failure(other.find({Boxes(boxes), nullptr}), Status::ranks_disagree, "NaN policy");
  settings = test_settings();
  settings.imbalance = is_last() ? 0.5 : 1.5;
  TypeParam third(MPI_COMM_WORLD, settings);
  expect_failure(third.find({Boxes(boxes), nullptr}), Status::bad_option,
                 last() + "Settings::imbalance is 0.5");
}

TYPED_TEST(Failures, DuplicateIdsAreNamed) {
  const auto boxes = tests::uniform_boxes(20, 3);
  std::vector<std::uint64_t> ids(20);
  for (std::size_t i = 0; i < 20; ++i) ids[i] = 100 * static_cast<std::uint64_t>(rank_here()) + i;
  TypeParam finder(MPI_COMM_WORLD, test_settings());
  EXPECT_TRUE(finder.find({Boxes(boxes), ids.data()}).ok());
  if (is_last()) ids[4] = 7;  // an id of rank 0; with one rank its own
  expect_failure(finder.find({Boxes(boxes), ids.data()}), Status::ranks_disagree,
                 "id 7 was given twice, by ranks 0 and " + std::to_string(rank_count() - 1));
  if (is_last()) ids[4] = 999999;
  EXPECT_TRUE(finder.find({Boxes(boxes), ids.data()}).ok());
  if (rank_count() == 1) return;
  expect_failure(finder.find({Boxes(boxes), is_last() ? nullptr : ids.data()}),
                 Status::ranks_disagree, "some ranks give ids");
}

// Ids are sent for checking only if the set of ids over all ranks changed.
TYPED_TEST(Failures, MigratedIdsAreNotCheckedAgain) {
  const auto boxes = tests::uniform_boxes(3000, 6);
  const auto ranks = static_cast<std::size_t>(rank_count());
  std::vector<std::uint64_t> ids(boxes.size() / ranks);
  const auto take_slice = [&](std::size_t slice) {
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = 5 + ids.size() * slice + i;
  };
  TypeParam finder(MPI_COMM_WORLD, test_settings());
  const RankBoxes mine{Boxes(boxes.data(), ids.size()), ids.data()};
  const auto sent_bytes = [&] { return sum_over_ranks(finder.traffic().control.bytes); };
  take_slice(static_cast<std::size_t>(rank_here()));
  ASSERT_TRUE(finder.find(mine).ok());
  const std::uint64_t some = ranks > 1 ? ids.size() : 0;  // a single rank sends none
  EXPECT_GE(sent_bytes(), some);
  for (std::size_t round = 1; round < 3; ++round) {
    take_slice((static_cast<std::size_t>(rank_here()) + round) % ranks);
    ASSERT_TRUE(finder.find(mine).ok());
    EXPECT_EQ(sent_bytes(), 0u) << round;
  }
  if (is_last()) ids[0] = ids[1];
  EXPECT_EQ(finder.find(mine).status, Status::ranks_disagree);
  if (is_last()) ids[0] = 1;
  ASSERT_TRUE(finder.find(mine).ok());
  EXPECT_GE(sent_bytes(), some);
}

// A search that cannot run on one rank: an instruction set that no machine has.
TEST(HostFailures, FailedSearchOnOneRankFailsOnAll) {
  const auto boxes = tests::uniform_boxes(20, 4);
  Settings settings = test_settings();
#ifdef __aarch64__
  if (is_last()) settings.search.isa = Isa::avx2;
#else
  if (is_last()) settings.search.isa = Isa::neon;
#endif
  Finder finder(MPI_COMM_WORLD, settings);
  expect_failure(finder.find({Boxes(boxes), nullptr}), Status::unsupported_isa, last());
}

// Run separately (tests/CMakeLists.txt): the communicator is unusable afterwards.
TEST(DISABLED_Late, AMissingRankTimesOut) {
  const auto boxes = tests::uniform_boxes(20, 5);
  Settings settings = test_settings();
  settings.timeout_seconds = 1;
  Finder finder(MPI_COMM_WORLD, settings);
  EmulatedFinder<Buffers::direct> device(MPI_COMM_WORLD, settings);
  ASSERT_TRUE(finder.find({Boxes(boxes), nullptr}).ok());
  ASSERT_TRUE(device.find({Boxes(boxes), nullptr}).ok());
  const auto start = std::chrono::steady_clock::now();
  if (rank_here() != 0) {
    for (int k = 0; k < 4; ++k) {
      const Result r =
          k < 2 ? finder.find({Boxes(boxes), nullptr}) : device.find({Boxes(boxes), nullptr});
      EXPECT_EQ(r.status, Status::rank_failed);
      EXPECT_NE(std::string(r.message).find(k % 2 == 0 ? "did not make the call"
                                                       : "an earlier call failed"),
                std::string::npos)
          << r.message;
    }
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
    std::printf("reported the late rank\n");
  }
  std::fflush(stdout);
  MPI_Barrier(MPI_COMM_WORLD);
  // Operations started with rank 0 never complete: only MPI_Abort ends all ranks cleanly.
  if (rank_here() == 0) MPI_Abort(MPI_COMM_WORLD, 3);
  std::this_thread::sleep_for(std::chrono::seconds(60));
}

TEST(DISABLED_Dead, ADeadRankEndsTheJob) {
  const auto boxes = tests::uniform_boxes(20, 6);
  Finder finder(MPI_COMM_WORLD, test_settings());
  ASSERT_TRUE(finder.find({Boxes(boxes), nullptr}).ok());
  if (rank_here() == 1) std::raise(SIGKILL);
  (void)finder.find({Boxes(boxes), nullptr});
  std::printf("not reached\n");
}

}  // namespace
}  // namespace throng::mpi
