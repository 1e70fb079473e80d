// The program throng-paper, as users run it.
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "apps/paper/cuda.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"
#include "tests/apps/throng/cli_test.hpp"

namespace throng::test {
namespace {

class Program : public CliTest {
 protected:
  std::string file(const std::string& name, const std::vector<Box>& boxes) const {
    spill(at(name), npy("<f4", std::to_string(boxes.size()) + ", 6", boxes.data(),
                        boxes.size() * sizeof(Box)));
    return at(name);
  }
};

TEST_F(Program, every_variant_finds_the_same_pairs) {
  const std::vector<Box> boxes = tests::uniform_boxes(300, 4);
  const std::string path = file("boxes.npy", boxes);
  const std::vector<std::vector<std::string>> variants = {
      {},
      {"--mapping", "lazy", "--output", "byte"},
      {"--mapping", "stored", "--write", "owned"},
      {"--mapping", "fold", "--write", "atomic", "--threads", "2"},
      {"--mapping", "exact", "--output", "pairs"},
      {"--root", "carmack", "--steps", "3"},
      {"--root", "lomont", "--repair", "--repeat", "3"},
      {"--root", "float64", "--no-repair", "--radicand", "real"},
      {"--grid", "8"},
      {"--grid", "0.5", "--mapping", "lazy"},
      {"--grid", "4", "--environment", "-1", "-1", "-1", "3", "3", "3"}};
  const std::size_t truth = tests::reference_pairs(boxes).pairs.size();
  std::string checksum;
  for (std::vector<std::string> arguments : variants) {
    arguments.insert(arguments.begin(), {"pairs", path, "--check"});
    const nlohmann::json output = json(arguments);
    ASSERT_TRUE(output.is_object());
    EXPECT_EQ(output["pairs"], truth);
    EXPECT_EQ(output["n"], 300);
    EXPECT_EQ(output["check"]["missing"], 0);
    if (checksum.empty()) checksum = output["checksum"];
    EXPECT_EQ(output["checksum"], checksum);
    EXPECT_GT(output["total_ms"], 0);
  }
  EXPECT_NE(checksum, "0000000000000000");
}

TEST_F(Program, check_reports_the_race) {
  const std::string path = file("same.npy", tests::identical_boxes(64, 2));
  const ProcessOutput output = run({"pairs", path, "--write", "racy", "--check"});
  EXPECT_EQ(output.status, 1) << output.err;
  EXPECT_NE(output.out.find("1,764 missing, 0 too many"), std::string::npos) << output.out;
  EXPECT_EQ(run({"pairs", path, "--write", "ballot", "--check"}).status, 0);
}

TEST_F(Program, reports_a_wrong_root) {
  const ProcessOutput output =
      run({"pairs", "--scene", "line", "--objects", "4098", "--no-repair"});
  EXPECT_EQ(output.status, 0) << output.err;
  EXPECT_NE(output.out.find("wrong at an end of 1 rows, first at index 4,096"), std::string::npos)
      << output.out;
  EXPECT_EQ(run({"pairs", "--scene", "line", "--objects", "4K"}).out.find("wrong"),
            std::string::npos);
}

TEST_F(Program, frames_are_steps) {
  const nlohmann::json one = json({"pairs", "--scene", "pile", "--objects", "500", "--grid", "4"});
  const nlohmann::json output = json(
      {"pairs", "--scene", "pile", "--objects", "500", "--frames", "3", "--grid", "4", "--check"});
  EXPECT_EQ(output["frames"], 3);
  EXPECT_GT(output["pairs"], one["pairs"]);
  EXPECT_EQ(output["check"]["missing"], 0);
  const ProcessOutput written =
      run({"pairs", "--scene", "pile", "--objects", "500", "-o", at("pairs.npy")});
  EXPECT_EQ(written.status, 0) << written.err;
  EXPECT_GT(slurp(at("pairs.npy")).size(), 128u + one["pairs"].get<std::size_t>() * 8 - 1);
}

TEST_F(Program, refuses_invalid_combinations) {
  const std::string path = file("boxes.npy", tests::uniform_boxes(20, 4));
  refuses({}, {"no command", "pairs"});
  refuses({"pairs"}, {"FILE.npy", "--scene"});
  refuses({"pairs", path, "--scene", "uniform"}, {"both"});
  refuses({"pairs", at("absent.npy")}, {"absent.npy"});
  refuses({"pairs", "--scene", "nowhere", "--objects", "5"}, {"nowhere", "uniform"});
  refuses({"pairs", "--scene", "uniform", "--objects", "many"}, {"--objects", "many"});
  refuses({"pairs", path, "--mapping", "clever"}, {"--mapping", "clever"});
  refuses({"pairs", path, "--root", "carmack", "--steps", "5"}, {"--steps", "5"});
  refuses({"pairs", path, "--steps", "2"}, {"--steps", "carmack"});
  refuses({"pairs", path, "--mapping", "lazy", "--root", "float64"}, {"lazy", "--root"});
  refuses({"pairs", path, "--grid", "0"}, {"--grid", "0"});
  refuses({"pairs", path, "--grid", "8", "--output", "bit"}, {"--grid", "--output"});
  refuses({"pairs", path, "--grid", "8", "--mapping", "stored"}, {"--mapping", "--grid"});
  refuses({"pairs", path, "--environment", "0", "0", "0", "1", "1", "1"}, {"--grid"});
  refuses({"pairs", path, "--grid", "8", "--environment", "0", "0", "5", "1", "1", "1"},
          {"--environment", "0 0 5 1 1 1"});
  refuses({"pairs", path, "--output", "byte", "--write", "racy"}, {"--write", "byte"});
  refuses({"pairs", "--scene", "uniform", "--objects", "1M"},
          {"62,499,937,500 bytes", "--output pairs", "--grid"});
  refuses({"pairs", "--scene", "uniform", "--objects", "1K", "--memory", "32K"},
          {"62,440", "32,768"});
  refuses({"pairs", "--scene", "uniform", "--objects", "900G", "--grid", "8"},
          {"900G", "--memory"});
  refuses({}, {"-o DIR", "pairs"});
  refuses({"--quick", "--only", "table9", "-o", at("x")}, {"--only", "table9", "table7"});
  refuses({"--quick", "--up-to", "many", "-o", at("x")}, {"--up-to", "many"});
  spill(at("file"), "in the way");
  refuses({"--only", "examples", "-o", at("file/paper")}, {"file/paper"});
  std::vector<Box> bad = tests::uniform_boxes(20, 4);
  std::memset(static_cast<void*>(&bad[7].lower.y), 0xff, sizeof(float));
  refuses({"pairs", file("nan.npy", bad)}, {"nan.npy", "NaN", "index 7"});
}

TEST_F(Program, cuda_is_refused_if_unavailable) {
  if (paper::why_no_cuda().empty()) {
    const nlohmann::json gpu =
        json({"pairs", "--scene", "pile", "--objects", "2K", "--device", "cuda"});
    EXPECT_EQ(gpu["checksum"], json({"pairs", "--scene", "pile", "--objects", "2K"})["checksum"]);
    return;
  }
  refuses({"pairs", "--scene", "uniform", "--objects", "10", "--device", "cuda"},
          {"--device cuda", "--device cpu"});
  refuses({"-o", at("x"), "--backend", "cuda"}, {"--backend cuda"});
  EXPECT_FALSE(exists("x"));
}

// The page, a table per section, and all rows in one file; only the requested sections.
TEST_F(Program, evaluates_into_a_folder) {
  const ProcessOutput output =
      run({"--quick", "--up-to", "1000", "--backend", "cpu", "--threads", "2", "--only", "examples",
           "--only", "table5", "-o", at("deep/paper")});
  EXPECT_EQ(output.status, 0) << output.err;
  for (const char* word : {"(75, 303)", "one bit, racy as printed", "The page: "})
    EXPECT_NE(output.out.find(word), std::string::npos) << word;
  EXPECT_NE(output.err.find("Table 5: one byte, 1000 objects"), std::string::npos) << "progress";
  for (const char* name : {"index.html", "rows.csv", "examples.csv", "table5.csv"})
    EXPECT_TRUE(exists(std::string("deep/paper/") + name)) << name;
  EXPECT_FALSE(exists("deep/paper/table6.csv"));
  const std::string page = slurp(at("deep/paper/index.html"));
  EXPECT_NE(page.find("</html>"), std::string::npos);
  EXPECT_NE(page.find("data-series"), std::string::npos);
}

TEST_F(Program, list_and_help) {
  const ProcessOutput list = run({"--list"});
  EXPECT_EQ(list.status, 0) << list.err;
  for (const char* word : {"formula", "lazy", "stored", "fold", "lomont", "ballot", "cuda", "pile"})
    EXPECT_NE(list.out.find(word), std::string::npos) << word;
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, {"pairs", "--help"}}) {
    const ProcessOutput help = run(arguments);
    EXPECT_EQ(help.status, 0);
    EXPECT_NE(help.out.find("Example"), std::string::npos) << arguments[0];
  }
}

}  // namespace
}  // namespace throng::test
