// throng-bench frames: methods that keep their objects find the same pairs in every frame as the
// library, and the output can be read line by line. And each other subcommand on small cases.
#ifndef _WIN32
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <throng/find_pairs.hpp>

#include "apps/common/child.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::bench {
namespace {

using Lines = std::vector<std::string>;

struct Output {
  int status = -1;
  Lines lines;  // of standard output and standard error
};

Output run(const Lines& arguments) {
  Output output;
  Lines words = {"-c", "exec \"$0\" \"$@\" 2>&1", THRONG_BENCH};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const common::ChildEnd end = common::run_child(
      "/bin/sh", words, 100, [&](const std::string& line) { output.lines.push_back(line); });
  output.status = end.status;
  return output;
}

struct Scene {
  const char *name, *moving;
  std::size_t objects, first, frames;
};

TEST(Frames, EveryMethodFindsTheSamePairs) {
  const Output list = run({"frames", "--list"});
  ASSERT_EQ(list.status, 0);
  ASSERT_GE(list.lines.size(), 2u);
  // The boxes of the column leave the bounds that some methods are given at first.
  for (const Scene& s : {Scene{"column", "0.25", 2000, 49, 6}, Scene{"column", "1", 1500, 20, 5},
                         Scene{"nbody", "1", 1000, 0, 4}, Scene{"mixed", "0.5", 800, 7, 3},
                         Scene{"uniform", "1", 1, 0, 1}}) {
    scenes::Spec spec;
    spec.name = s.name;
    spec.moving = std::atof(s.moving);
    spec.objects = s.objects;
    spec.seed = 3;
    const scenes::Scene scene(spec);
    std::vector<std::string> expected;
    std::vector<Box> boxes(s.objects);
    for (std::size_t f = s.first + 1; f <= s.first + s.frames; ++f) {
      scene.frame(f, boxes.data());
      expected.push_back(std::to_string(find_pairs(boxes).size()));
    }
    for (const std::string& library : list.lines) {
      SCOPED_TRACE(library + ", " + s.name);
      const Output output =
          run({"frames", "--library", library, "--scene", s.name, "--objects",
               std::to_string(s.objects), "--moving", s.moving, "--seed", "3", "--first",
               std::to_string(s.first), "--frames", std::to_string(s.frames)});
      ASSERT_EQ(output.status, 0) << (output.lines.empty() ? "" : output.lines.back());
      ASSERT_EQ(output.lines.size(), s.frames + 2);
      EXPECT_EQ(output.lines[0], "frame,ms,pairs");
      for (std::size_t k = 1; k < output.lines.size(); ++k) {
        std::string frame, ms, pairs;
        std::istringstream line(output.lines[k]);
        std::getline(line, frame, ',');
        std::getline(line, ms, ',');
        std::getline(line, pairs);
        EXPECT_EQ(frame, k == 1 ? "insert" : std::to_string(s.first + k - 1));
        EXPECT_EQ(pairs, k == 1 ? "0" : expected[k - 2]) << output.lines[k];
        EXPECT_GE(std::stod(ms), 0);
      }
    }
  }
}

TEST(Frames, BulletIsListed) {
  const Lines all = run({"frames", "--list"}).lines;
  const auto is_bullet = [](const std::string& name) { return name.rfind("Bullet ", 0) == 0; };
  if (std::none_of(all.begin(), all.end(), is_bullet)) GTEST_SKIP() << "Bullet is not installed";
  for (const char* name :
       {"Bullet btDbvt, default", "Bullet btDbvt, deferred", "Bullet bt32BitAxisSweep3"}) {
    EXPECT_EQ(std::count(all.begin(), all.end(), name), 1) << name;
  }
}

TEST(Frames, BadInputIsRefused) {
  const std::string library = run({"frames", "--list"}).lines.at(0);
  const auto refuses = [](const Lines& arguments, const std::string& words) {
    const Output output = run(arguments);
    EXPECT_EQ(output.status, 2) << words;
    std::string text;
    for (const std::string& line : output.lines) text += line + "\n";
    EXPECT_NE(text.find(words), std::string::npos) << text;
    EXPECT_EQ(text.find("frame,ms"), std::string::npos) << text;
  };
  refuses({"frames"}, "--library: found none");
  refuses({"frames", "--library", "none"}, "found 'none', wanted one of: " + library);
  refuses({"frames", "--library", library, "--scene", "cube"}, "no scene has the name 'cube'");
  refuses({"frames", "--library", library, "--scene", "worlds"}, "one world");
  refuses({"frames", "--library", library, "--objects", "0"}, "--objects: found 0");
  refuses({"frames", "--library", library, "--objects", "5X"}, "--objects: found '5X'");
  refuses({"frames", "--library", library, "--moving", "1.5"}, "moving");
  refuses({"frames", "--library", library, "--moving", "nan"}, "moving");
  refuses({"frames", "--library", library, "--frames", "0"}, "--frames");
  refuses({"frames", "--library", library, "--first", "-1"}, "--first");
  refuses({"frames", "--library", library, "--first", "16777216"}, "frames");
  refuses({"frames", "--library", library, "--size", "3"}, "--size");
  refuses({"frames", "--list", "more"}, "more");
}

// The first line of every CSV file.
constexpr const char* columns =
    "machine,date,commit,kind,case,objects,setting,library,threads,metric,value,least,samples,"
    "found,"
    "checksum,note";

Lines lines_of(const std::string& path) {
  Lines lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

class Subcommands : public ::testing::TestWithParam<Lines> {};

TEST_P(Subcommands, WriteTheSharedSchema) {
  Lines arguments = GetParam();
  const std::string kind = arguments[0],
                    path = ::testing::TempDir() + "throng_bench_" + kind + ".csv";
  arguments.insert(arguments.end(), {"--csv", path, "--machine", "here", "--commit", "abc1234"});
  const Output output = run(arguments);
  ASSERT_EQ(output.status, 0) << (output.lines.empty() ? "" : output.lines.back());
  EXPECT_GE(output.lines.size(), 3u);
  const Lines lines = lines_of(path);
  std::remove(path.c_str());
  ASSERT_GE(lines.size(), 2u);
  EXPECT_EQ(lines[0], columns);
  for (std::size_t k = 1; k < lines.size(); ++k) {
    EXPECT_EQ(lines[k].rfind("here,", 0), 0u) << lines[k];
    EXPECT_NE(lines[k].find(",abc1234," + kind + ","), std::string::npos) << lines[k];
  }
}

INSTANTIATE_TEST_SUITE_P(
    Small, Subcommands,
    ::testing::Values(
        Lines{"search", "--scene", "uniform", "--objects", "1000", "--rounds", "1", "--no-memory"},
        Lines{"moving", "--max-objects", "1000", "--rounds", "2", "--only", "uniform"},
        Lines{"queries", "--max-objects", "1000", "--rounds", "2", "--only", "uniform; 1 % move"},
        Lines{"filters", "--max-objects", "1000", "--rounds", "2", "--threads", "2"},
        Lines{"doubles", "--max-objects", "1000", "--rounds", "2"},
        Lines{"mesh", "--max-objects", "1000", "--rounds", "2"},
        Lines{"bodies", "--max-objects", "1000", "--rounds", "2"}),
    [](const auto& each) { return each.param[0]; });

TEST(Search, PrintsASummaryAndDetailsOnRequest) {
  const Lines arguments = {"--scene",  "uniform", "--objects",  "500,1000",
                           "--rounds", "1",       "--no-memory"};
  const auto text_of = [](const Output& output) {
    std::string text;
    for (const std::string& line : output.lines) text += line + "\n";
    return text;
  };
  const Output summary = run(arguments);
  EXPECT_EQ(summary.status, 0);
  EXPECT_LE(summary.lines.size(), 12u) << text_of(summary);
  const std::string text = text_of(summary);
  for (const char* words :
       {"best other", "factor", "uniform    500", "uniform     1K", "--details"})
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
  for (const char* words : {"floor", "goal", "checksum"})
    EXPECT_EQ(text.find(words), std::string::npos) << words << "\n" << text;
  Lines more = arguments;
  more.push_back("--details");
  const std::string details = text_of(run(more));
  for (const char* words : {"Machine", "checksum", "Throng, sorted", "best other"})
    EXPECT_NE(details.find(words), std::string::npos) << words << "\n" << details;
}

TEST(Commands, SearchIsTheDefault) {
  const Output help = run({"--help"});
  ASSERT_EQ(help.status, 0);
  for (const char* name :
       {"search", "moving", "queries", "filters", "doubles", "bodies", "mesh", "frames"}) {
    const auto names = [&](const std::string& line) {
      return line.rfind(std::string("  ") + name + " ", 0) == 0;
    };
    EXPECT_TRUE(std::any_of(help.lines.begin(), help.lines.end(), names)) << name;
    const Output options = run({name, "--help"});
    EXPECT_EQ(options.status, 0) << name;
    for (const std::string& line : options.lines)
      EXPECT_EQ(line.find("{false}"), std::string::npos) << line;
    EXPECT_EQ(run({name, "--nothing"}).status, 2) << name;
  }
  const Output output = run({"--scene", "nothing"});
  EXPECT_EQ(output.status, 2);
  ASSERT_FALSE(output.lines.empty());
  EXPECT_EQ(output.lines.back().rfind("throng-bench search: no scene has the name 'nothing'", 0),
            0u)
      << output.lines.back();
}

}  // namespace
}  // namespace throng::bench
#endif
