// Full disks and signals at any time: the final name holds a complete file, an older one or none,
// and no other file remains. Windows has neither such signals nor a limit on a file's size.
#ifndef _WIN32
#include "tests/apps/throng/cli_test.hpp"

#include <chrono>
#include <thread>

namespace throng::test {
namespace {

class Faults : public CliTest {
 protected:
  std::size_t parts() const {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(folder_))
      count += entry.path().string().find(".part") != std::string::npos;
    return count;
  }
  // `frames` times the same n boxes in one place.
  void write_heaps(std::size_t frames, std::size_t n) const {
    std::vector<float> values;
    for (std::size_t i = 0; i < frames * n; ++i) values.insert(values.end(), {0, 0, 0, 1, 1, 1});
    spill(at("heaps.npy"),
          npy("<f4", std::to_string(frames) + ", " + std::to_string(n) + ", 6", values));
  }
};

// The write at the limit is a short one; the next fails.
TEST_F(Faults, a_disk_that_is_full_at_any_byte) {
  write_heaps(1, 400);
  const std::vector<std::string> pairs = {"pairs", at("heaps.npy"), "-o", at("out.npy")};
  const std::vector<std::string> scene = {"scene", "worlds", "--objects",
                                          "30K",   "-o",     at("out.npy")};
  for (const auto& command : {pairs, scene}) {
    fs::remove(at("out.npy"));
    ASSERT_EQ(run(command).status, 0);
    const auto whole = std::uint64_t{fs::file_size(at("out.npy"))};
    ASSERT_GT(whole, std::uint64_t{1} << 18);
    spill(at("out.npy"), "old");
    for (const std::uint64_t size_limit :
         {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{127}, std::uint64_t{128},
          std::uint64_t{5000}, (std::uint64_t{1} << 18) - 1, (std::uint64_t{1} << 18) + 1,
          whole - 1}) {
      Limits limits;
      limits.file_size = size_limit;
      // Redirects the program's messages to a file, too.
      limits.out_path = "/dev/null";
      const ProcessOutput output = run(command, limits);
      EXPECT_EQ(output.status, 2) << command[0] << " with " << size_limit;
      EXPECT_EQ(slurp(at("out.npy")), "old");
      EXPECT_EQ(parts(), 0u);
    }
    Limits enough;
    enough.file_size = whole;
    EXPECT_EQ(run(command, enough).status, 0);
    EXPECT_EQ(fs::file_size(at("out.npy")), whole);
  }
}

TEST_F(Faults, a_signal_while_pairs_are_written) {
  write_heaps(4000, 300);  // 1.4 GB of pairs if it is not stopped
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const Process process = start(THRONG_PROGRAM, {"pairs", at("heaps.npy"), "-o", at("pairs.npy")},
                                  at("output.out"), at("output.err"), folder_, {});
    for (int i = 0; i < 5000 && parts() == 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_EQ(parts(), 1u);
    kill(process, signal);
    EXPECT_EQ(wait_for(process), 128 + signal) << slurp(at("output.err"));
    EXPECT_FALSE(exists("pairs.npy"));
    EXPECT_EQ(parts(), 0u);
    EXPECT_NE(slurp(at("output.err")).find("no partial file is left"), std::string::npos);
  }
}

TEST_F(Faults, a_signal_at_any_time) {
  write_heaps(60, 300);
  const std::vector<std::string> pairs = {"pairs", at("heaps.npy"), "-o", at("out.npy")};
  const std::vector<std::string> scene = {"scene",    "worlds", "--objects", "200K",
                                          "--frames", "4",      "-o",        at("out.npy")};
  for (const auto& command : {pairs, scene}) {
    const std::string other = at("out-world.npy");
    ASSERT_EQ(run(command).status, 0);
    const auto whole = fs::file_size(at("out.npy"));
    for (int ms = 0; ms < 60; ms += 4) {
      fs::remove(at("out.npy"));
      fs::remove(other);
      const Process process =
          start(THRONG_PROGRAM, command, at("output.out"), at("output.err"), folder_, {});
      std::this_thread::sleep_for(std::chrono::milliseconds(ms));
      kill(process, ms % 8 ? SIGTERM : SIGINT);
      (void)wait_for(process);
      EXPECT_EQ(parts(), 0u) << command[0] << " after " << ms << " ms";
      if (exists("out.npy")) {
        EXPECT_EQ(fs::file_size(at("out.npy")), whole);
      }
      if (exists("out-world.npy")) {
        EXPECT_EQ(fs::file_size(other), 200000u * 4 + 128);
      }
    }
  }
}

}  // namespace
}  // namespace throng::test
#endif
