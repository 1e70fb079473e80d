// A child program's lines arrive while it runs, and one without output is stopped.
#ifndef _WIN32
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

#include "program/child.hpp"
#include "program/failure.hpp"

namespace throng::program {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Heard {
  ChildEnd end;
  std::vector<std::string> lines;
  std::vector<double> seconds;  // after the start
};

Heard hear(const std::string& script, double quiet_seconds,
           const std::vector<std::string>& more = {}) {
  Heard heard;
  std::vector<std::string> arguments = {"-c", script, "sh"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const auto start = Clock::now();
  heard.end = run_child("/bin/sh", arguments, quiet_seconds, [&](const std::string& line) {
    heard.lines.push_back(line);
    heard.seconds.push_back(since(start));
  });
  return heard;
}

bool no_child_left() { return waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD; }

using Lines = std::vector<std::string>;

TEST(Child, EachLineAndTheStatus) {
  const Heard heard = hear("echo one; echo; printf 'two\\nthree'; echo unheard >&2; exit 7", 20);
  EXPECT_EQ(heard.lines, (Lines{"one", "", "two", "three"}));
  EXPECT_FALSE(heard.end.stopped);
  EXPECT_EQ(heard.end.status, 7);
  EXPECT_TRUE(no_child_left());
  EXPECT_EQ(hear("exit 0", 0).end.status, 0);
  EXPECT_EQ(hear("kill -TERM $$", 20).end.status, 128 + 15);
}

TEST(Child, ArgumentsAreNoShellWords) {
  const Lines words = {"a b", "$HOME; exit 9", "", "'\"\\*"};
  EXPECT_EQ(hear("for word in \"$@\"; do printf '%s\\n' \"$word\"; done", 20, words).lines, words);
}

TEST(Child, LinesComeAtOnce) {
  const Heard heard = hear("echo early; sleep 1; echo late", 20);
  ASSERT_EQ(heard.lines, (Lines{"early", "late"}));
  EXPECT_GT(heard.seconds[1] - heard.seconds[0], 0.5);
}

TEST(Child, ManyLongLines) {
  const Heard heard =
      hear("i=0; while [ $i -lt 2000 ]; do printf '%01000d\\n' $i; i=$((i+1)); done", 20);
  ASSERT_EQ(heard.lines.size(), 2000u);
  for (std::size_t i = 0; i < heard.lines.size(); ++i) {
    ASSERT_EQ(heard.lines[i].size(), 1000u);
    ASSERT_EQ(std::stoul(heard.lines[i]), i);
  }
}

TEST(Child, IsStoppedWhenNoLineComes) {
  const auto start = Clock::now();
  Heard heard = hear("echo one; exec sleep 60", 0.5);
  EXPECT_TRUE(heard.end.stopped);
  EXPECT_EQ(heard.lines, Lines{"one"});
  // Text without a line end is not a line.
  heard = hear("while :; do printf x; sleep 0.05; done", 0.5);
  EXPECT_TRUE(heard.end.stopped);
  EXPECT_EQ(heard.lines, Lines{});
  // Closing the output does not end the child.
  heard = hear("exec >&-; exec sleep 60", 0.5);
  EXPECT_TRUE(heard.end.stopped);
  EXPECT_LT(since(start), 30);
  EXPECT_TRUE(no_child_left());
}

TEST(Child, EachLineGivesItTimeAnew) {
  const Heard heard = hear("for i in 1 2 3 4 5 6; do sleep 0.5; echo $i; done", 2);
  EXPECT_FALSE(heard.end.stopped);
  EXPECT_EQ(heard.lines.size(), 6u);
}

TEST(Child, WhatTheListenerThrowsEndsIt) {
  const auto start = Clock::now();
  EXPECT_THROW(run_child("/bin/sh", {"-c", "echo one; exec sleep 60"}, 100,
                         [](const std::string&) { throw std::out_of_range("enough"); }),
               std::out_of_range);
  EXPECT_LT(since(start), 30);
  EXPECT_TRUE(no_child_left());
}

TEST(Child, WhatCannotBeStartedIsSaid) {
  for (const char* path : {"/no/such/program", "/etc"}) {
    try {
      run_child(path, {}, 1, [](const std::string&) {});
      ADD_FAILURE() << path;
    } catch (const Failure& failure) {
      EXPECT_NE(std::string(failure.what()).find(path), std::string::npos) << failure.what();
      EXPECT_EQ(failure.status(), exit_bad);
    }
  }
  EXPECT_TRUE(no_child_left());
}

}  // namespace
}  // namespace throng::program
#endif
