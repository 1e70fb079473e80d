// throng-bench-frames: the libraries with persistent objects find the same pairs in every frame as
// this library, and its output can be parsed line by line.
#ifndef _WIN32
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <throng/find_pairs.hpp>

#include "program/child.hpp"
#include "scene/scene.hpp"

namespace throng::bench {
namespace {

using Lines = std::vector<std::string>;

struct Said {
  int status = -1;
  Lines lines;  // of standard output and standard error
};

Said run(const Lines& arguments) {
  Said said;
  Lines words = {"-c", "exec \"$0\" \"$@\" 2>&1", THRONG_FRAMES};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const program::ChildEnd end = program::run_child(
      "/bin/sh", words, 100, [&](const std::string& line) { said.lines.push_back(line); });
  said.status = end.status;
  return said;
}

struct Scene {
  const char *name, *moving;
  std::size_t objects, first, frames;
};

TEST(Frames, EveryRivalFindsWhatTheLibraryFinds) {
  const Said list = run({"--list"});
  ASSERT_EQ(list.status, 0);
  ASSERT_GE(list.lines.size(), 2u);
  // The boxes of the column move beyond the bounds that some libraries got at first.
  for (const Scene& s : {Scene{"column", "0.25", 2000, 49, 6}, Scene{"column", "1", 1500, 20, 5},
                         Scene{"nbody", "1", 1000, 0, 4}, Scene{"mixed", "0.5", 800, 7, 3},
                         Scene{"uniform", "1", 1, 0, 1}}) {
    scene::Spec spec;
    spec.name = s.name;
    spec.moving = std::atof(s.moving);
    spec.objects = s.objects;
    spec.seed = 3;
    const scene::Scene scene(spec);
    std::vector<std::string> expected;
    std::vector<Box> boxes(s.objects);
    for (std::size_t f = s.first + 1; f <= s.first + s.frames; ++f) {
      scene.frame(f, boxes.data());
      expected.push_back(std::to_string(find_pairs(boxes).size()));
    }
    for (const std::string& rival : list.lines) {
      SCOPED_TRACE(rival + ", " + s.name);
      const Said said =
          run({"--rival", rival, "--scene", s.name, "--objects", std::to_string(s.objects),
               "--moving", s.moving, "--seed", "3", "--first", std::to_string(s.first), "--frames",
               std::to_string(s.frames)});
      ASSERT_EQ(said.status, 0) << (said.lines.empty() ? "" : said.lines.back());
      ASSERT_EQ(said.lines.size(), s.frames + 2);
      EXPECT_EQ(said.lines[0], "frame,ms,pairs");
      for (std::size_t k = 1; k < said.lines.size(); ++k) {
        std::string frame, ms, pairs;
        std::istringstream line(said.lines[k]);
        std::getline(line, frame, ',');
        std::getline(line, ms, ',');
        std::getline(line, pairs);
        EXPECT_EQ(frame, k == 1 ? "insert" : std::to_string(s.first + k - 1));
        EXPECT_EQ(pairs, k == 1 ? "0" : expected[k - 2]) << said.lines[k];
        EXPECT_GE(std::stod(ms), 0);
      }
    }
  }
}

TEST(Frames, BulletIsPlayed) {
  const Lines all = run({"--list"}).lines;
  const auto is_bullet = [](const std::string& name) { return name.rfind("Bullet ", 0) == 0; };
  if (std::none_of(all.begin(), all.end(), is_bullet)) GTEST_SKIP() << "Bullet is not installed";
  for (const char* name :
       {"Bullet btDbvt, default", "Bullet btDbvt, deferred", "Bullet bt32BitAxisSweep3"}) {
    EXPECT_EQ(std::count(all.begin(), all.end(), name), 1) << name;
  }
}

TEST(Frames, BadInputIsSaid) {
  const std::string rival = run({"--list"}).lines.at(0);
  const auto refuses = [](const Lines& arguments, const std::string& words) {
    const Said said = run(arguments);
    EXPECT_EQ(said.status, 2) << words;
    std::string text;
    for (const std::string& line : said.lines) text += line + "\n";
    EXPECT_NE(text.find(words), std::string::npos) << text;
    EXPECT_EQ(text.find("frame,ms"), std::string::npos) << text;
  };
  refuses({}, "--rival: found none");
  refuses({"--rival", "no one"}, "found 'no one', wanted one of: " + rival);
  refuses({"--rival", rival, "--scene", "cube"}, "no scene has the name 'cube'");
  refuses({"--rival", rival, "--scene", "worlds"}, "one world");
  refuses({"--rival", rival, "--objects", "0"}, "--objects: found 0");
  refuses({"--rival", rival, "--objects", "5X"}, "--objects: found '5X'");
  refuses({"--rival", rival, "--moving", "1.5"}, "moving");
  refuses({"--rival", rival, "--moving", "nan"}, "moving");
  refuses({"--rival", rival, "--frames", "0"}, "--frames");
  refuses({"--rival", rival, "--first", "-1"}, "--first");
  refuses({"--rival", rival, "--first", "16777216"}, "frames");
  refuses({"--rival", rival, "--size", "3"}, "--size");
  refuses({"--list", "more"}, "more");
}

}  // namespace
}  // namespace throng::bench
#endif
