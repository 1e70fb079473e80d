// Figures 5 and 6 with a fake competitor: its times are reported, and it is stopped when it is
// slow.
#include <fstream>
#include <string>
#include <vector>

#include "apps/paper/evaluation/experiments.hpp"
#include "tests/apps/throng/cli_test.hpp"

namespace throng::paper {
namespace {

class Competitors : public test::CliTest {
 protected:
#ifdef _WIN32
  void SetUp() override {
    test::CliTest::SetUp();
    GTEST_SKIP() << "the fake is a shell script";
  }
#endif
  // A program with the command line of the benchmark program.
  Lab with(const std::string& script) const {
    const std::string path = at("competitors");
    test::spill(path, "#!/bin/sh\n" + script);
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    Setting setting;
    setting.quick = true;
    setting.up_to = 3000;
    setting.limit_seconds = 0.2;
    setting.competitors = path;
    return Lab(setting);
  }
};

const Row* last_of(const Section& section, const std::string& what) {
  const Row* found = nullptr;
  for (const Row& row : section.rows) {
    if (row.what == what) found = &row;
  }
  return found;
}

TEST_F(Competitors, ReportsTheTimesOfItsFrames) {
  const Section section =
      figure5(with("echo frame,ms,pairs; echo insert,50,0; echo 50,7,11; echo 51,9,12\n"));
  const Row* row = last_of(section, "Bullet btDbvt, default");
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->n, 3000u);
  EXPECT_EQ(*row->measured, 8);
  EXPECT_EQ(*row->pairs, 12u);
  EXPECT_NE(section.finding.find("ahead"), std::string::npos) << section.finding;
  ASSERT_EQ(section.plots.size(), 1u);
  EXPECT_NE(section.plots[0].html().find("Bullet bt32BitAxisSweep3"), std::string::npos);
}

TEST_F(Competitors, SlowOnesAreStoppedAndSkipped) {
  const Section section =
      figure5(with("case \"$3\" in *Sweep*) exec sleep 20;; *) echo insert,1,0; echo 50,5,1; echo "
                   "51,5,1;; esac\n"));
  std::size_t stopped = 0, left_out = 0;
  for (const Row& row : section.rows) {
    if (row.what != "Bullet bt32BitAxisSweep3") continue;
    EXPECT_FALSE(row.measured);
    stopped += row.found.find("stopped: adding the objects took over 1 s") != std::string::npos;
    left_out += row.found.find("stopped at 1,000 objects before") != std::string::npos;
  }
  EXPECT_EQ(stopped, 1u);
  EXPECT_EQ(left_out, 1u);
  EXPECT_TRUE(last_of(section, "Bullet btDbvt, default")->measured);
}

TEST_F(Competitors, StopsAfterASlowFrame) {
  const Section section = figure5(with("echo insert,1,0; echo 50,250,1; exec sleep 20\n"));
  std::size_t stopped = 0, left_out = 0;
  for (const Row& row : section.rows) {
    if (row.what != "Bullet btDbvt, default") continue;
    stopped +=
        row.measured && row.found.find("stopped: a frame took over 0.2 s") != std::string::npos;
    left_out += row.found.find("skipped: stopped") != std::string::npos;
  }
  EXPECT_EQ(stopped, 1u);
  EXPECT_EQ(left_out, 1u);
}

TEST_F(Competitors, SkipsSlowInsertions) {
  const Section section = figure5(with("echo insert,1500,0; echo 50,5,1\n"));
  const Row* row = last_of(section, "Bullet bt32BitAxisSweep3");
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->n, 3000u);
  EXPECT_FALSE(row->measured);
  EXPECT_NE(row->found.find("about 14"), std::string::npos) << row->found;
}

TEST_F(Competitors, ReportsFailures) {
  const Section section = figure6(with("exit 3\n"));
  const Row* row = last_of(section, "Bullet btDbvt, default");
  ASSERT_NE(row, nullptr);
  EXPECT_FALSE(row->measured);
  EXPECT_NE(row->found.find("status 3"), std::string::npos) << row->found;
}

}  // namespace
}  // namespace throng::paper
