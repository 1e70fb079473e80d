// The content of a Finder's capture: each form, each filter, each bit; and the result if it cannot
// be written.
#ifndef _WIN32
#include <sys/resource.h>
#endif

#include <csignal>
#include <cstring>
#include <stdexcept>
#include <thread>

#include <throng/throng.hpp>

#include "capture/folder.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"
#include "support/same_bits.hpp"

namespace throng::tests {
namespace {

class FinderCapture : public CaptureTest {};

TEST_F(FinderCapture, HasBoxesFiltersAndResult) {
  BoxList boxes = uniform_boxes(300, 1);
  std::uint32_t payload = 0x7fc12345u;  // a NaN with a payload
  std::memcpy(&boxes[7].lower.y, &payload, 4);
  boxes[8].upper.z = -0.0f;
  const std::size_t n = boxes.size();
  std::vector<std::uint32_t> group(n, 5), mask(n, 9);
  std::vector<std::int32_t> owner(n, -1), world(n, -1);
  std::vector<std::uint8_t> is_static(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    mask[i] = static_cast<std::uint32_t>(i * 2654435761u) | 1;
    owner[i] = static_cast<std::int32_t>(i / 3);
    world[i] = static_cast<std::int32_t>(i % 3) - 1;
    is_static[i] = i % 2;
  }
  Boxes view = boxes;
  view.filters = {{group.data(), n},
                  {mask.data(), n},
                  {owner.data(), n},
                  {world.data(), n},
                  {is_static.data(), n}};
  Options o = options();
  o.nan = NanPolicy::inactive;
  o.margin = 0.25f;
  o.order = Order::canonical;
  o.threads = 2;
  Finder finder(o);
  const Result r = finder.find(view);
  ASSERT_TRUE(r.ok());
  EXPECT_STREQ(r.message, "");
  EXPECT_GT(r.found, 0u);
  ASSERT_EQ(files().size(), 1u);
  const scenes::Capture c = last();
  EXPECT_EQ(c.library, THRONG_VERSION);
  EXPECT_FALSE(c.truncated);
  EXPECT_EQ(c.options.margin, 0.25f);
  EXPECT_EQ(c.options.order, Order::canonical);
  EXPECT_EQ(c.options.nan, NanPolicy::inactive);
  EXPECT_EQ(c.options.threads, 2u);
  ASSERT_EQ(c.calls.size(), 1u);
  ASSERT_EQ(c.calls[0].sets.size(), 1u);
  const scenes::CapturedBoxes& set = c.calls[0].sets[0];
  EXPECT_TRUE(same_bits(set.boxes, boxes));
  EXPECT_EQ(set.group, group);
  EXPECT_EQ(set.mask, mask);
  EXPECT_EQ(set.owner, owner);
  EXPECT_EQ(set.world, world);
  EXPECT_EQ(set.is_static, is_static);
  ASSERT_TRUE(c.calls[0].answer);
  EXPECT_EQ(c.calls[0].answer->found, r.found);
  EXPECT_EQ(c.calls[0].answer->inactive, r.inactive);
  EXPECT_EQ(c.calls[0].answer->checksum,
            pair_checksum(finder.pairs().data(), finder.pairs().size()));
  // Searching the captured boxes gives the same pairs.
  o.capture = nullptr;
  Finder again(o);
  ASSERT_TRUE(again.find(set.view()).ok());
  EXPECT_TRUE(same_pairs(to_vector(again.pairs()), to_vector(finder.pairs())));
}

TEST_F(FinderCapture, EachFormOfACall) {
  const BoxList a = uniform_boxes(200, 2), b = uniform_boxes(300, 2);
  Finder finder(options());
  std::vector<Pair> out(1000);
  ASSERT_TRUE(finder.find(a, b).ok());
  const std::uint64_t right = pair_checksum(finder.pairs().data(), finder.pairs().size());
  const std::size_t total = finder.pairs().size();
  ASSERT_GT(total, 10u);
  EXPECT_EQ(last().calls[0].sets.size(), 2u);
  EXPECT_TRUE(same_bits(last().calls[0].sets[1].boxes, b));
  EXPECT_EQ(last().calls[0].answer->checksum, right);

  ASSERT_TRUE(finder.find(a, b, out.data(), 1000).ok());
  EXPECT_EQ(static_cast<capture::Form>(last().calls[0].form), capture::Form::buffer);
  EXPECT_EQ(last().calls[0].capacity, 1000u);
  EXPECT_EQ(last().calls[0].answer->checksum, right);

  EXPECT_EQ(finder.find(a, b, out.data(), 5).status, Status::buffer_too_small);
  EXPECT_EQ(last().calls[0].answer->status, Status::buffer_too_small);
  EXPECT_EQ(last().calls[0].answer->found, total);
  EXPECT_EQ(last().calls[0].answer->checksum, pair_checksum(out.data(), 5));

  std::size_t taken = 0;
  const auto take = [&](const Pair*, std::size_t count) {
    taken += count;
    return true;
  };
  ASSERT_TRUE(finder.consume(a, b, take).ok());
  EXPECT_EQ(taken, total);
  EXPECT_EQ(static_cast<capture::Form>(last().calls[0].form), capture::Form::consumer);
  EXPECT_EQ(last().calls[0].answer->checksum, right);

  std::vector<Pair> grown;
  ASSERT_TRUE(find_pairs(a, b, grown, options()).ok());
  EXPECT_EQ(grown.size(), total);
  EXPECT_EQ(last().calls[0].answer->checksum, right);

  Options emulated = options();
  emulated.backend = Backend::emulated;
  EXPECT_EQ(find_pairs(a, b, emulated).size(), total);
  EXPECT_EQ(last().calls[0].answer->backend, Backend::emulated);
  EXPECT_EQ(last().calls[0].answer->checksum, right);
  EXPECT_EQ(files().size(), 6u);
}

TEST_F(FinderCapture, FlatStridedAndRefusedBoxes) {
  const float lower[] = {0, 0, 1, 1, 5, 5}, upper[] = {1, 1, 2, 2, 6, 6};
  Finder finder(options());
  ASSERT_TRUE(finder
                  .find(Boxes::arrays(lower, lower + 1, nullptr, upper, upper + 1, nullptr, 3,
                                      2 * sizeof(float)))
                  .ok());
  EXPECT_TRUE(last().calls[0].sets[0].view().is_flat());
  EXPECT_EQ(last().calls[0].sets[0].boxes[1].upper.y, 2.0f);
  EXPECT_EQ(last().calls[0].answer->found, 1u);
  // One box, repeated.
  const Box one = cube(1, 2, 3, 4);
  ASSERT_TRUE(finder.find(Boxes(&one, 10, 0)).ok());
  EXPECT_EQ(last().calls[0].sets[0].boxes.size(), 10u);
  EXPECT_EQ(last().calls[0].answer->found, 45u);
  ASSERT_TRUE(finder.find(Boxes()).ok());
  EXPECT_EQ(last().calls[0].sets[0].boxes.size(), 0u);
  const BoxList bad = {cube(std::numeric_limits<float>::quiet_NaN(), 0, 0, 1)};
  EXPECT_EQ(finder.find(bad).status, Status::nan_box);
  EXPECT_EQ(last().calls[0].answer->status, Status::nan_box);
}

// If the consumer throws, the capture has the input but no answer.
TEST_F(FinderCapture, AConsumerThatThrows) {
  const BoxList boxes = identical_boxes(50, 1);
  Finder finder(options());
  const auto thrower = [](const Pair*, std::size_t) -> bool { throw std::runtime_error("mine"); };
  EXPECT_THROW((void)finder.consume(boxes, thrower), std::runtime_error);
  EXPECT_FALSE(last().calls[0].answer);
  EXPECT_TRUE(same_bits(last().calls[0].sets[0].boxes, boxes));
}

TEST_F(FinderCapture, CannotBeWritten) {
  const BoxList boxes = identical_boxes(200, 1);
  const std::size_t pairs = 199 * 100;
  std::string nowhere = folder_ + "/nowhere", file = folder_ + "/file", longest(2000, 'x');
  std::ofstream(file) << "mine";
  for (const std::string& folder : {nowhere, file, longest, std::string("/proc")}) {
    Options o = options();
    o.capture = folder.c_str();
    Finder finder(o);
    const Result r = finder.find(boxes);
    EXPECT_EQ(r.status, Status::ok) << folder;
    EXPECT_EQ(finder.pairs().size(), pairs);
    EXPECT_NE(std::string(r.message).find("capture was not written"), std::string::npos)
        << r.message;
  }
  EXPECT_EQ(files().size(), 1u) << "only the existing file";
  EXPECT_EQ(last_bytes(), "mine");
}

#ifndef _WIN32
// A file system that fails in the middle of each write in turn: the result is correct, the message
// reports it, and no partial file is left.
TEST_F(FinderCapture, AFullDisk) {
  const BoxList boxes = identical_boxes(100, 1);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old = std::signal(SIGXFSZ, SIG_IGN);
  Finder finder(options());
  ASSERT_TRUE(finder.find(boxes).ok());
  const std::size_t whole = last_bytes().size();
  std::filesystem::remove(files()[0]);
  for (std::size_t limit :
       {std::size_t{0}, std::size_t{3}, std::size_t{40}, std::size_t{700}, whole - 30, whole - 1}) {
    rlimit small = before;
    small.rlim_cur = limit;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const Result r = finder.find(boxes);
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(r.status, Status::ok);
    EXPECT_EQ(finder.pairs().size(), 4950u);
    EXPECT_NE(std::string(r.message).find("File too large"), std::string::npos) << r.message;
    EXPECT_EQ(files().size(), 0u) << "a file of " << limit << " bytes was left";
  }
  std::signal(SIGXFSZ, old);
}
#endif

// Calls within the same microsecond: no file is lost or overwritten.
TEST_F(FinderCapture, ManyThreadsAtOnce) {
  const BoxList boxes = uniform_boxes(20, 1);
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&] {
      Options o = options();
      o.threads = 1;
      Finder finder(o);
      for (int k = 0; k < 20; ++k) EXPECT_STREQ(finder.find(boxes).message, "");
    });
  }
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(files().size(), 160u);
  for (const std::string& path : files()) {
    EXPECT_EQ(scenes::read_capture(path).calls[0].sets[0].boxes.size(), 20u);
  }
}

TEST_F(FinderCapture, NoneByDefault) {
  Finder finder;
  ASSERT_TRUE(finder.find(uniform_boxes(50, 1)).ok());
  EXPECT_EQ(files().size(), 0u);
}

}  // namespace
}  // namespace throng::tests
