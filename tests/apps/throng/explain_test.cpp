// throng explain, as users run it.
#include <limits>
#include <string>
#include <vector>

#include "tests/apps/throng/cli_test.hpp"

namespace throng::test {
namespace {

using Explain = CliTest;

TEST_F(Explain, TextJsonAndPageAgree) {
  ASSERT_EQ(run({"scene", "mixed", "--objects", "3K", "-o", at("m.npy")}).status, 0);
  const nlohmann::json report = json({"explain", at("m.npy")});
  const nlohmann::json pairs = json({"pairs", at("m.npy")});
  EXPECT_EQ(report["boxes"], 3000);
  EXPECT_EQ(report["pairs"], pairs["pairs"]);
  EXPECT_EQ(report["reason"], pairs["plan"]["reason"]);
  EXPECT_EQ(report["largest"].size(), 10u);
  EXPECT_EQ(report["largest"][0]["index"], 0) << "the ground plane";
  EXPECT_GT(report["tests_per_pair"], 0);
  std::uint64_t boxes = 0;
  for (const auto& c : report["size_classes"]) boxes += c["boxes"].get<std::uint64_t>();
  EXPECT_EQ(boxes, 3000u);

  const ProcessOutput output =
      run({"explain", at("m.npy"), "--html", at("page.html"), "--threads", "1"});
  EXPECT_EQ(output.status, 0) << output.err;
  for (const char* words :
       {"The search", "Boxes by size", "#####", "Cells by number of boxes", "The largest boxes",
        "The cells with the most boxes", "tests per pair"}) {
    EXPECT_NE(output.out.find(words), std::string::npos) << words;
  }
  const std::string page = slurp(at("page.html"));
  for (const char* words : {"The cells with the most boxes", "Cells by number of boxes",
                            "data-bar=\"1 to 2\"", "</svg>", "</html>"}) {
    EXPECT_NE(page.find(words), std::string::npos) << words;
  }
}

TEST_F(Explain, ListsTheLargestBoxesOnlyIfSizesDiffer) {
  ASSERT_EQ(run({"scene", "pile", "--objects", "1K", "-o", at("p.npy")}).status, 0);
  const ProcessOutput output = run({"explain", at("p.npy")});
  EXPECT_EQ(output.status, 0) << output.err;
  EXPECT_EQ(output.out.find("The largest boxes"), std::string::npos) << output.out;
  EXPECT_EQ(json({"explain", at("p.npy")})["largest"].size(), 10u);
}

TEST_F(Explain, RefusesBadInput) {
  std::vector<float> boxes(12, 1);
  boxes[7] = std::numeric_limits<float>::quiet_NaN();
  spill(at("nan.npy"), npy("<f4", "2, 6", boxes));
  refuses({"explain", at("nan.npy")}, {"nan.npy", "NaN", "1"});
  refuses({"explain", at("none.npy")}, {"none.npy"});
  boxes[7] = 1;
  spill(at("fine.npy"), npy("<f4", "2, 6", boxes));
  refuses({"explain", at("fine.npy"), "--html", at("no/such/page.html")}, {"page.html"});
  for (const char* backend : {"emulated", "cuda"})
    refuses({"explain", at("fine.npy"), "--backend", backend}, {"--backend", "auto", "cpu"});
  EXPECT_EQ(run({"explain", at("fine.npy"), "--backend", "cpu"}).status, 0);
  const ProcessOutput help = run({"explain", "--help"});
  EXPECT_EQ(help.out.find("emulated"), std::string::npos) << help.out;
}

}  // namespace
}  // namespace throng::test
