// throng pairs --memory: boxes that do not fit, and the files left after failures.
#include "support/sanitized.hpp"
#include "tests/apps/throng/cli_test.hpp"

#include <chrono>
#include <cstring>
#include <thread>

namespace throng::test {
namespace {

class Memory : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    // Puts temporary files where files() sees them.
    set_environment("TMPDIR", folder_.string().c_str());
  }
  void TearDown() override {
    set_environment("TMPDIR", nullptr);
    CliTest::TearDown();
  }
  void make(const std::string& scene, const std::string& n) const {
    ASSERT_EQ(run({"scene", scene, "--objects", n, "-o", at("boxes.npy")}).status, 0);
  }
};

TEST_F(Memory, slabs_find_the_same_within_the_cap) {
  make("pile", "100K");
  const auto free = json({"pairs", at("boxes.npy"), "-o", at("free.npy"), "--order", "canonical"});
  for (const char* order : {"any", "canonical"}) {
    const auto j =
        json({"pairs", at("boxes.npy"), "--memory", "6M", "-o", at("slabs.npy"), "--order", order});
    EXPECT_EQ(j.at("n"), 100000);
    EXPECT_EQ(j.at("pairs"), free.at("pairs"));
    EXPECT_EQ(j.at("checksum"), free.at("checksum"));
    EXPECT_GT(j.at("streamed").at("slabs"), 2);
    EXPECT_GT(j.at("streamed").at("scratch_bytes"), 100000 * 28);
#if !THRONG_SANITIZED
    // Not counted: pages of the program touched for the first time, and stacks.
    EXPECT_LT(j.at("peak_bytes").get<std::size_t>(), (6u << 20) + (3u << 20));
#endif
    EXPECT_EQ(slurp(at("slabs.npy")).size(), slurp(at("free.npy")).size());
  }
  EXPECT_EQ(slurp(at("slabs.npy")), slurp(at("free.npy")));
  EXPECT_EQ(files(), 3u);
  // A box with lower > upper is named in slabs, too.
  std::string bytes = slurp(at("boxes.npy"));
  const float up = 1e9f;
  std::memcpy(bytes.data() + (bytes.size() - 24 * 321), &up, sizeof up);
  spill(at("boxes.npy"), bytes);
  refuses({"pairs", at("boxes.npy"), "--memory", "6M"},
          {"1 boxes have lower > upper, the first is box 99679; for empty slots use --inverted"});
  const auto left = json({"pairs", at("boxes.npy"), "--memory", "6M", "--inverted", "inactive"});
  EXPECT_EQ(left.at("inactive"), 1);
  // If all fits, nothing is streamed.
  EXPECT_FALSE(json({"pairs", at("boxes.npy"), "--inverted", "inactive", "--memory", "64M"})
                   .contains("streamed"));
}

TEST_F(Memory, text_output_names_slabs) {
  make("uniform", "50K");
  const ProcessOutput output = run({"pairs", at("boxes.npy"), "--memory", "4M"});
  EXPECT_EQ(output.status, 0) << output.err;
  EXPECT_NE(output.out.find(" slabs, "), std::string::npos) << output.out;
  EXPECT_EQ(output.err, "");
}

TEST_F(Memory, a_cap_that_is_too_small_names_the_bytes) {
  make("uniform", "1000");
  const ProcessOutput output = run({"pairs", at("boxes.npy"), "--memory", "100"});
  EXPECT_EQ(output.status, 2);
  const std::string before = "found 100 bytes, wanted at least ";
  const std::size_t found = output.err.find(before);
  ASSERT_NE(found, std::string::npos) << output.err;
  const std::string least = std::to_string(std::stoull(output.err.substr(found + before.size())));
  EXPECT_EQ(run({"pairs", at("boxes.npy"), "--memory", least}).status, 0);
}

TEST_F(Memory, a_truncated_file_is_one_error) {
  make("uniform", "50K");
  fs::resize_file(at("boxes.npy"), 1000000);
  refuses({"pairs", at("boxes.npy"), "--memory", "4M", "-o", at("p.npy")},
          {"boxes.npy", "1200000", "999872"});
  EXPECT_EQ(files(), 1u);
}

#ifndef _WIN32  // no limit on a file's size
TEST_F(Memory, a_full_disk_is_one_error) {
  make("pile", "50K");
  spill(at("p.npy"), "old");
  // The limit applies first to the temporary file of rows, then to the pairs.
  Limits limits;
  limits.file_size = 1 << 20;
  refuses({"pairs", at("boxes.npy"), "--memory", "4M", "-o", at("p.npy")},
          {"temporary file", folder_.string(), "TMPDIR"}, limits);
  limits.file_size = 1900 << 10;
  refuses({"pairs", at("boxes.npy"), "--memory", "4M", "-o", at("p.npy")}, {"p.npy"}, limits);
  EXPECT_EQ(slurp(at("p.npy")), "old");
  EXPECT_EQ(files(), 2u);
}
#endif

#ifdef __linux__
TEST_F(Memory, an_interrupted_search_leaves_nothing) {
  make("pile", "600K");
  const std::vector<std::string> search = {"pairs", at("boxes.npy"), "--memory", "4M",
                                           "-o",    at("p.npy"),     "--order",  "canonical"};
  ASSERT_EQ(run(search).status, 0);
  const std::string whole = slurp(at("p.npy"));
  ASSERT_TRUE(fs::remove(at("p.npy")));
  for (const int signal : {SIGINT, SIGTERM}) {
    int interrupted = 0;
    for (const int wait_ms : {20, 60, 200, 500}) {
      const Process process =
          start(THRONG_PROGRAM, search, at("output.out"), at("output.err"), folder_, {});
      ASSERT_GT(process, 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
      kill(process, signal);
      // Before the first file is created a signal ends the program at once: nothing to clean up.
      const int status = wait_for(process);
      const bool done = fs::exists(at("p.npy"));  // it was faster than the signal
      if (done) {
        EXPECT_TRUE(slurp(at("p.npy")) == whole);
        EXPECT_TRUE(fs::remove(at("p.npy")));
      }
      EXPECT_TRUE((done && status == 0) || status == 130 || status == 128 + signal) << status;
      interrupted += !done;
      EXPECT_EQ(files(), 1u) << "only the boxes may be there, after " << wait_ms << " ms";
    }
    EXPECT_GT(interrupted, 0) << "a larger scene is wanted";
  }
}
#endif

TEST_F(Memory, scenes_are_written_in_little_memory) {
#if THRONG_SANITIZED
  GTEST_SKIP() << "sanitizers need the whole address space";
#endif
  Limits limits;
  limits.address_space = std::uint64_t{96} << 20;  // the file has 192 MB
  EXPECT_EQ(run({"scene", "worlds", "--objects", "8M", "-o", at("u.npy")}, limits).status, 0);
  EXPECT_EQ(fs::file_size(at("u.npy")), 192000128u);
  EXPECT_EQ(fs::file_size(at("u-world.npy")), 32000128u);
}

}  // namespace
}  // namespace throng::test
