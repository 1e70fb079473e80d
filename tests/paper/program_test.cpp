// The program throng-paper, as a user runs it.
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "cli/child.hpp"
#include "paper/cuda.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

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

TEST_F(Program, every_variant_tells_the_same_pairs_and_checksum) {
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
    const nlohmann::json said = json(arguments);
    ASSERT_TRUE(said.is_object());
    EXPECT_EQ(said["pairs"], truth);
    EXPECT_EQ(said["n"], 300);
    EXPECT_EQ(said["check"]["missing"], 0);
    if (checksum.empty()) checksum = said["checksum"];
    EXPECT_EQ(said["checksum"], checksum);
    EXPECT_GT(said["total_ms"], 0);
  }
  EXPECT_NE(checksum, "0000000000000000");
}

TEST_F(Program, check_sees_the_race) {
  const std::string path = file("same.npy", tests::identical_boxes(64, 2));
  const Said said = run({"pairs", path, "--write", "racy", "--check"});
  EXPECT_EQ(said.status, 1) << said.err;
  EXPECT_NE(said.out.find("1,764 missing, 0 too many"), std::string::npos) << said.out;
  EXPECT_EQ(run({"pairs", path, "--write", "ballot", "--check"}).status, 0);
}

TEST_F(Program, tells_that_a_root_is_wrong) {
  const Said said = run({"pairs", "--scene", "line", "--objects", "4098", "--no-repair"});
  EXPECT_EQ(said.status, 0) << said.err;
  EXPECT_NE(said.out.find("wrong at an end of 1 rows, first at index 4,096"), std::string::npos)
      << said.out;
  EXPECT_EQ(run({"pairs", "--scene", "line", "--objects", "4K"}).out.find("wrong"),
            std::string::npos);
}

TEST_F(Program, frames_are_steps) {
  const nlohmann::json one = json({"pairs", "--scene", "pile", "--objects", "500", "--grid", "4"});
  const nlohmann::json said = json(
      {"pairs", "--scene", "pile", "--objects", "500", "--frames", "3", "--grid", "4", "--check"});
  EXPECT_EQ(said["frames"], 3);
  EXPECT_GT(said["pairs"], one["pairs"]);
  EXPECT_EQ(said["check"]["missing"], 0);
  const Said written = run({"pairs", "--scene", "pile", "--objects", "500", "-o", at("pairs.npy")});
  EXPECT_EQ(written.status, 0) << written.err;
  EXPECT_GT(slurp(at("pairs.npy")).size(), 128u + one["pairs"].get<std::size_t>() * 8 - 1);
}

TEST_F(Program, refuses_what_cannot_be) {
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
  refuses({"roots", "--up-to", "5"}, {"--up-to", "5"});
  refuses({"measure", "--csv", at("no/such/folder.csv")}, {"folder.csv"});
  std::vector<Box> bad = tests::uniform_boxes(20, 4);
  std::memset(static_cast<void*>(&bad[7].lower.y), 0xff, sizeof(float));
  refuses({"pairs", file("nan.npy", bad)}, {"nan.npy", "NaN", "index 7"});
}

TEST_F(Program, cuda_is_refused_where_it_is_not) {
  if (paper::why_no_cuda().empty()) {
    const nlohmann::json gpu =
        json({"pairs", "--scene", "pile", "--objects", "2K", "--device", "cuda"});
    EXPECT_EQ(gpu["checksum"], json({"pairs", "--scene", "pile", "--objects", "2K"})["checksum"]);
    return;
  }
  refuses({"pairs", "--scene", "uniform", "--objects", "10", "--device", "cuda"},
          {"--device cuda", "--device cpu"});
  refuses({"measure", "--csv", at("x.csv"), "--device", "cuda"}, {"--device cuda"});
  EXPECT_FALSE(exists("x.csv"));
}

TEST_F(Program, roots_tells_table_three) {
  const Said said = run({"roots", "--up-to", "10K", "--objects", "500", "--repeat", "1"});
  EXPECT_EQ(said.status, 0) << said.err;
  for (const char* line : {"Carmack 2, double, x*y                2.9000    0.8900",
                           "Lomont 3, double, 1/y                 0.7000    0.1200"})
    EXPECT_NE(said.out.find(line), std::string::npos) << said.out;
}

// Rows of one experiment and n agree on the pairs, but for the racy ones.
TEST_F(Program, measure_writes_rows_that_agree) {
  const Said said = run({"measure", "--csv", at("rows.csv"), "--up-to", "1000", "--device", "cpu",
                         "--repeat", "2", "--scene", "pile"});
  EXPECT_EQ(said.status, 0) << said.err;
  std::istringstream rows(slurp(at("rows.csv")));
  std::string line;
  std::getline(rows, line);
  EXPECT_EQ(line, "experiment,variant,device,n,median_ms,pairs,checksum");
  std::map<std::string, std::string> answers;
  std::map<std::string, int> counts;
  while (std::getline(rows, line)) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 7u) << line;
    ++counts[cells[0]];
    EXPECT_GE(std::stod(cells[4]), 0) << line;
    if (cells[1].find("racy") != std::string::npos) continue;
    const std::string answer = cells[5] + " " + cells[6];
    EXPECT_EQ(answers.emplace(cells[3], answer).first->second, answer) << line;
  }
  EXPECT_EQ(answers.size(), 2u);  // n = 100 and 1000
  EXPECT_EQ(counts["table2"], 8);
  EXPECT_EQ(counts["table5"], 20);
  EXPECT_EQ(counts["table6"], 24);
  EXPECT_EQ(counts["table7"], 6);
}

TEST_F(Program, lists_and_helps) {
  const Said list = run({"--list"});
  EXPECT_EQ(list.status, 0) << list.err;
  for (const char* word : {"formula", "lazy", "stored", "fold", "lomont", "ballot", "cuda", "pile"})
    EXPECT_NE(list.out.find(word), std::string::npos) << word;
  for (const char* command : {"pairs", "roots", "measure"}) {
    const Said help = run({command, "--help"});
    EXPECT_EQ(help.status, 0);
    EXPECT_NE(help.out.find("Example"), std::string::npos) << command;
  }
}

}  // namespace
}  // namespace throng::test
