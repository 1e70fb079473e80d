// throng-mpi under mpirun: recorded data, and errors in files and options.
#include <cstdlib>
#include <limits>

#include "tests/apps/throng/cli_test.hpp"

namespace throng::test {
namespace {

class Program : public CliTest {
 protected:
  // The mpirun arguments before the program's path.
  ProcessOutput ranks(int count, const std::vector<std::string>& arguments,
                      const std::vector<std::string>& others = {}) const {
    std::vector<std::string> words = {"--oversubscribe", "--bind-to", "none"};
    const auto add = [&](int n, const std::vector<std::string>& more) {
      words.insert(words.end(), {"-n", std::to_string(n), THRONG_RANKS});
      words.insert(words.end(), more.begin(), more.end());
    };
    add(count, arguments);
    if (!others.empty()) {
      words.push_back(":");
      add(1, others);
    }
    return run_program(THRONG_MPIRUN, words);
  }
  // Checks for exit status 2, no standard output, and one line per rank, all with the same message.
  void refuses_all(const ProcessOutput& output, std::size_t count, const std::string& words) const {
    EXPECT_EQ(output.status, 2) << output.err;
    EXPECT_EQ(output.out, "");
    std::size_t lines = 0;
    for (std::size_t at = 0; (at = output.err.find("throng-mpi: ", at)) != std::string::npos;
         ++at) {
      EXPECT_NE(output.err.substr(at, output.err.find('\n', at) - at).find(words),
                std::string::npos)
          << "no '" << words << "' in: " << output.err;
      ++lines;
    }
    EXPECT_EQ(lines, count) << output.err;
  }
};

TEST_F(Program, finds_the_pairs_of_the_recorded_data) {
  const char* folder = std::getenv("THRONG_DATA");
  if (!folder) GTEST_SKIP() << "THRONG_DATA does not name the folder of recorded boxes";
  const struct {
    const char* file;
    std::uint64_t pairs;
    const char* checksum;
  } known[] = {{"bounds02.npy", 14969, "8a5b4278ca3373ad"},
               {"cloth-funnel.npy", 805888, "9e35f6c6f96859f1"}};
  for (const auto& k : known) {
    const ProcessOutput output =
        ranks(4, {"pairs", std::string(folder) + "/" + k.file, "--threads", "1", "--json"});
    ASSERT_EQ(output.status, 0) << output.err;
    const auto json = nlohmann::json::parse(output.out);
    EXPECT_EQ(json["pairs"], k.pairs) << k.file;
    EXPECT_EQ(json["checksum"], k.checksum) << k.file;
  }
}

TEST_F(Program, equals_a_single_process) {
  ASSERT_EQ(run({"scene", "worlds", "--objects", "3K", "--frames", "2", "-o", at("w.npy")}).status,
            0);
  const auto one = json({"pairs", at("w.npy"), "--world", at("w-world.npy")});
  const ProcessOutput output = ranks(3, {"pairs", at("w.npy"), "--world", at("w-world.npy"),
                                         "--threads", "1", "--json", "-o", at("p.npy")});
  ASSERT_EQ(output.status, 0) << output.err;
  const auto many = nlohmann::json::parse(output.out);
  EXPECT_EQ(many["pairs"], one["pairs"]);
  EXPECT_EQ(many["checksum"], one["checksum"]);
  EXPECT_EQ(many["ranks"], 3);
  const std::string bytes = slurp(at("p.npy"));
  EXPECT_EQ(bytes.size(), 128 + 16 * one["pairs"].get<std::size_t>());
  EXPECT_NE(bytes.find("'<u8'"), std::string::npos);
  // The output follows a symbolic link, and does not touch a user file named like a temporary file.
  spill(at("p.npy.part"), "mine");
  std::filesystem::create_symlink("p.npy", at("link.npy"));
  ASSERT_EQ(ranks(2, {"pairs", at("w.npy"), "-o", at("link.npy")}).status, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(at("link.npy")));
  EXPECT_GT(slurp(at("p.npy")).size(), bytes.size());  // the worlds were not applied
  EXPECT_EQ(slurp(at("p.npy.part")), "mine");
  // The same program started as `throng pairs --mpi`.
  const ProcessOutput front =
      run({"pairs", "--mpi", at("w.npy"), "--world", at("w-world.npy"), "--json"});
  ASSERT_EQ(front.status, 0) << front.err;
  EXPECT_EQ(nlohmann::json::parse(front.out)["checksum"], one["checksum"]);
}

TEST_F(Program, equals_an_emulated_device) {
  ASSERT_EQ(run({"scene", "worlds", "--objects", "3K", "--frames", "2", "-o", at("w.npy")}).status,
            0);
  const auto one = json({"pairs", at("w.npy"), "--world", at("w-world.npy")});
  for (const char* buffers : {"direct", "staged"}) {
    const ProcessOutput output =
        ranks(3, {"pairs", at("w.npy"), "--world", at("w-world.npy"), "--on-device", "--backend",
                  "emulated", "--buffers", buffers, "--json"});
    ASSERT_EQ(output.status, 0) << output.err;
    const auto many = nlohmann::json::parse(output.out);
    EXPECT_EQ(many["pairs"], one["pairs"]);
    EXPECT_EQ(many["checksum"], one["checksum"]);
    EXPECT_EQ(many["device_memory_to_mpi"], buffers);
  }
  const ProcessOutput mixed =
      ranks(1, {"pairs", at("w.npy"), "--on-device", "--backend", "emulated"},
            {"pairs", at("w.npy"), "--on-device", "--backend", "emulated", "--buffers", "staged"});
  ASSERT_EQ(mixed.status, 0) << mixed.err;
  EXPECT_NE(mixed.out.find("device memory is passed to MPI direct on 1 of 2 ranks"),
            std::string::npos)
      << mixed.out;
  const ProcessOutput bench = ranks(
      2, {"bench", "--objects", "2K", "--frames", "1", "--on-device", "--backend", "emulated"});
  ASSERT_EQ(bench.status, 0) << bench.err;
  EXPECT_NE(bench.out.find("passed to MPI direct"), std::string::npos) << bench.out;
}

TEST_F(Program, reports_errors_once_per_rank) {
  ASSERT_EQ(run({"scene", "uniform", "--objects", "500", "-o", at("a.npy")}).status, 0);
  std::string bytes = slurp(at("a.npy"));
  spill(at("short.npy"), bytes.substr(0, bytes.size() - 24));
  refuses_all(ranks(2, {"pairs", at("short.npy")}), 2,
              "rank 0: " + at("short.npy") + ": found float32");
  spill(at("none_of_5.npy"), npy("<f4", "0, 5, 6", std::vector<float>()));
  refuses_all(ranks(2, {"pairs", at("none_of_5.npy")}), 2,
              "none_of_5.npy: found no frame of 5 boxes, wanted at least one frame");
  for (const char* seconds : {"-1", "nan"}) {
    refuses_all(ranks(1, {"pairs", at("a.npy"), "--seconds", seconds}), 1,
                std::string("--seconds: found ") + seconds);
  }
  refuses_all(ranks(2, {"pairs", at("a.npy"), "-o", at("a.npy")}), 2,
              "found the file of FILE as that of -o, too; wanted another name");
  refuses_all(ranks(2, {"pairs", at("a.npy"), "-o", "/dev/null"}), 2,
              "/dev/null: found a device or a pipe; wanted a file, which ranks write by parts");
  refuses_all(ranks(2, {"pairs", at("a.npy"), "--threads", "-1"}), 2,
              "--threads: found '-1', wanted 0 to 4294967295");
  refuses_all(ranks(2, {"pairs", at("a.npy")}, {"pairs", at("none.npy")}), 3, "rank 2: ");
  refuses_all(ranks(1, {"pairs", at("a.npy")}, {"pairs", at("a.npy"), "--margin", "1"}), 2,
              "disagree on the margin: from 0 to 1");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  bytes.replace(128 + 24 * 300, 4, reinterpret_cast<const char*>(&nan), 4);
  spill(at("nan.npy"), bytes);
  refuses_all(ranks(2, {"pairs", at("nan.npy")}), 2,
              "rank 1: 1 boxes have a NaN, the first is its box 50; fix them, or treat them as "
              "inactive by --nan inactive");
}

}  // namespace
}  // namespace throng::test
