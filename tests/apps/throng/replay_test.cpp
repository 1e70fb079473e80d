// throng replay: repeats a program's calls; detects captures with wrong results.
#include "tests/apps/throng/cli_test.hpp"

#include <throng/capture.hpp>
#include <throng/throng.hpp>

namespace throng::test {
namespace {

class Replay : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    fs::create_directory(at("captures"));
  }
  // The newest capture.
  std::string newest() const {
    std::string path;
    for (const auto& entry : fs::directory_iterator(at("captures")))
      path = std::max(path, entry.path().string());
    return path;
  }
  ProcessOutput captured(const std::vector<std::string>& arguments,
                         const std::string& folder) const {
    set_environment("THRONG_CAPTURE", folder.c_str());
    const ProcessOutput output = run(arguments);
    set_environment("THRONG_CAPTURE", nullptr);
    return output;
  }
  static std::vector<Box> boxes(int n) {
    std::vector<Box> list;
    for (int i = 0; i < n; ++i) {
      const float x = static_cast<float>(i) * 0.75f;
      list.push_back({{x, 0, 0}, {x + 1, 1, 1}});
    }
    return list;
  }
  // Changes a number of the last section, the result, and updates the checksum.
  static void corrupt_result(const std::string& path, std::size_t offset) {
    std::string bytes = slurp(path);
    const std::size_t at = bytes.size() - (16 + 7 * 8 + 4 * 4 + 8);
    bytes[at + offset] = static_cast<char>(bytes[at + offset] ^ 1);
    const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
    std::uint64_t sum = capture::fold(capture::fold_start, data + at, bytes.size() - 8 - at);
    for (std::size_t k = bytes.size() - 8; k < bytes.size(); ++k, sum >>= 8)
      bytes[k] = static_cast<char>(sum);
    spill(path, bytes);
  }
};

TEST_F(Replay, calls_of_a_finder) {
  ASSERT_EQ(run({"scene", "mixed", "--objects", "700", "-o", at("a.npy")}).status, 0);
  ASSERT_EQ(
      captured({"pairs", at("a.npy"), "--margin", "0.5", "--order", "canonical", "--threads", "2"},
               at("captures"))
          .status,
      0);
  const nlohmann::json report = json({"replay", newest()});
  EXPECT_EQ(report["agrees"], true);
  EXPECT_EQ(report["capture_agrees"], true);
  EXPECT_EQ(report["n"], 700);
  EXPECT_EQ(report["options"]["margin"], 0.5);
  EXPECT_EQ(report["options"]["order"], "canonical");
  EXPECT_EQ(report["expected"]["by"], "the double loop");
  EXPECT_GT(report["expected"]["pairs"], 100);
  EXPECT_GE(report["rows"].size(), 9u);
  const ProcessOutput text = run({"replay", newest()});
  EXPECT_EQ(text.status, 0);
  EXPECT_NE(text.out.find("emulated"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("all agree"), std::string::npos) << text.out;
}

TEST_F(Replay, unwritable_captures_are_reported) {
  ASSERT_EQ(run({"scene", "uniform", "--objects", "50", "-o", at("a.npy")}).status, 0);
  const ProcessOutput output = captured({"pairs", at("a.npy")}, at("no/such/folder"));
  EXPECT_EQ(output.status, 0);
  EXPECT_NE(output.err.find("capture was not written"), std::string::npos) << output.err;
  EXPECT_NE(output.out.find("checksum"), std::string::npos);
  EXPECT_FALSE(exists("no"));
  // An empty name does not mean the current folder, either.
  EXPECT_EQ(captured({"pairs", at("a.npy")}, "").err, "");
  EXPECT_EQ(files(), 2u);
}

TEST_F(Replay, a_wrong_answer_differs) {
  const std::string folder = at("captures");
  Options options;
  options.capture = folder.c_str();
  ASSERT_EQ(find_pairs(boxes(100), options).size(), 99u);
  const std::string good = slurp(newest());
  for (const std::size_t offset : {16, 16 + 6 * 8}) {  // the number of pairs; their checksum
    spill(newest(), good);
    EXPECT_EQ(run({"replay", newest()}).status, 0);
    corrupt_result(newest(), offset);
    const ProcessOutput output = run({"replay", newest()});
    EXPECT_EQ(output.status, 1) << output.out;
    EXPECT_NE(output.out.find("DIFFERS from the double loop"), std::string::npos) << output.out;
  }
}

TEST_F(Replay, a_refused_box_is_refused_again) {
  const std::string folder = at("captures");
  Options options;
  options.capture = folder.c_str();
  std::vector<Box> list = boxes(10);
  list[4].lower.x = NAN;
  Finder finder(options);
  ASSERT_EQ(finder.find(list).status, Status::nan_box);
  const ProcessOutput output = run({"replay", newest()});
  EXPECT_EQ(output.status, 0) << output.out;
  EXPECT_NE(output.out.find("box 4"), std::string::npos) << output.out;
}

TEST_F(Replay, calls_of_a_broad_phase) {
  const std::string folder = at("captures");
  Options options;
  options.capture = folder.c_str();
  const auto continue_calls = [&](BroadPhase& live) {
    for (int k = 0; k < 6; ++k) {
      std::vector<Box> moved = boxes(60);
      for (int i = 0; i < 60; i += k < 3 ? 1 : 20) moved[i].lower.x -= 0.3f * static_cast<float>(k);
      ASSERT_TRUE(live.move_all(moved).ok());
      if (k == 4) {
        ASSERT_TRUE(live.shift_origin({1, -2, 0.5f}).ok());
      }
      ASSERT_TRUE(live.update().ok());
      ASSERT_TRUE(live.find_overlaps(boxes(5)).ok());
      const Sweep sweep{boxes(1)[0], {20, 0, 0}};
      ASSERT_TRUE(live.find_hits(&sweep, 1).ok());
    }
  };
  {
    BroadPhase live(options);
    std::vector<ObjectId> ids(60);
    ASSERT_TRUE(live.add(boxes(60), ids.data()).ok());
    ASSERT_TRUE(live.update().ok());
    Filter filter;
    filter.is_static = 1;
    for (int i = 0; i < 20; ++i) ASSERT_EQ(live.set_filter(ids[i], filter), Status::ok);
    continue_calls(live);
    const std::string first = newest();
    nlohmann::json report = json({"replay", first});
    EXPECT_EQ(report["agrees"], true);
    EXPECT_EQ(report["updates"], 7);
    // The calls of a copy, from its initial objects.
    BroadPhase copy(options);
    ASSERT_TRUE(copy.copy_from(live).ok());
    continue_calls(copy);
    ASSERT_NE(newest(), first);
    report = json({"replay", newest()});
    EXPECT_EQ(report["agrees"], true) << report.dump(2);
    EXPECT_EQ(report["updates"], 6);
    ASSERT_TRUE(live.update().ok());
    EXPECT_EQ(run({"replay", first}).status, 0);
    corrupt_result(first, 16 + 6 * 8);
    const ProcessOutput output = run({"replay", first});
    EXPECT_EQ(output.status, 1) << output.out;
    EXPECT_NE(output.out.find("begin and end events"), std::string::npos) << output.out;
  }
}

TEST_F(Replay, files_that_are_not_captures) {
  refuses({"replay", at("nowhere")}, {"nowhere"});
  refuses({"replay", folder_.string()}, {folder_.string()});
  spill(at("a"), "");
  refuses({"replay", at("a")}, {"not a capture"});
  spill(at("b"), npy("<f4", "1, 6", std::vector<float>(6)));
  refuses({"replay", at("b")}, {"not a capture"});
  const std::string folder = at("captures");
  Options options;
  options.capture = folder.c_str();
  (void)find_pairs(boxes(30), options);
  const std::string good = slurp(newest());
  spill(at("c"), good.substr(0, 300));
  refuses({"replay", at("c")}, {"cut short"});
  std::string newer = good;
  newer[8] = 2;
  spill(at("d"), newer);
  refuses({"replay", at("d")}, {"format 2"});
  newer = good;
  newer[400] = static_cast<char>(newer[400] ^ 1);
  spill(at("e"), newer);
  refuses({"replay", at("e")}, {"damaged"});
}

}  // namespace
}  // namespace throng::test
