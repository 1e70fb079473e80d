// throng explain, as users run it.
#include <limits>
#include <string>
#include <vector>

#include "cli/child.hpp"

namespace throng::test {
namespace {

using Explain = CliTest;

TEST_F(Explain, TellsTheSameAsTextAsJsonAndAsAPage) {
  ASSERT_EQ(run({"scene", "mixed", "--objects", "3K", "-o", at("m.npy")}).status, 0);
  const nlohmann::json told = json({"explain", at("m.npy")});
  const nlohmann::json pairs = json({"pairs", at("m.npy")});
  EXPECT_EQ(told["boxes"], 3000);
  EXPECT_EQ(told["pairs"], pairs["pairs"]);
  EXPECT_EQ(told["reason"], pairs["plan"]["reason"]);
  EXPECT_EQ(told["largest"].size(), 10u);
  EXPECT_EQ(told["largest"][0]["index"], 0) << "the ground plane";
  EXPECT_GT(told["tests_per_pair"], 0);
  std::uint64_t boxes = 0;
  for (const auto& c : told["size_classes"]) boxes += c["boxes"].get<std::uint64_t>();
  EXPECT_EQ(boxes, 3000u);

  const Said said = run({"explain", at("m.npy"), "--html", at("page.html"), "--threads", "1"});
  EXPECT_EQ(said.status, 0) << said.err;
  for (const char* words :
       {"What was done", "The largest boxes", "The densest cells", "tests per pair", "Memory"}) {
    EXPECT_NE(said.out.find(words), std::string::npos) << words;
  }
  const std::string page = slurp(at("page.html"));
  for (const char* words : {"The densest cells", "How full the cells are", "</svg>", "</html>"}) {
    EXPECT_NE(page.find(words), std::string::npos) << words;
  }
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
  const Said help = run({"explain", "--help"});
  EXPECT_EQ(help.out.find("emulated"), std::string::npos) << help.out;
}

}  // namespace
}  // namespace throng::test
