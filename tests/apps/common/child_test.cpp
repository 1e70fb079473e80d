// A child program's lines arrive while it runs, and one without output is stopped.
#ifndef _WIN32
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/common/child.hpp"
#include "apps/common/failure.hpp"

namespace throng::common {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct ScriptRun {
  ChildEnd end;
  std::vector<std::string> lines;
  std::vector<double> seconds;  // after the start
};

ScriptRun run_script(const std::string& script, double quiet_seconds,
                     const std::vector<std::string>& more = {}) {
  ScriptRun run;
  std::vector<std::string> arguments = {"-c", script, "sh"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const auto start = Clock::now();
  run.end = run_child("/bin/sh", arguments, quiet_seconds, [&](const std::string& line) {
    run.lines.push_back(line);
    run.seconds.push_back(since(start));
  });
  return run;
}

bool no_child_left() { return waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD; }

using Lines = std::vector<std::string>;

TEST(Child, EachLineAndTheStatus) {
  const ScriptRun run =
      run_script("echo one; echo; printf 'two\\nthree'; echo unheard >&2; exit 7", 20);
  EXPECT_EQ(run.lines, (Lines{"one", "", "two", "three"}));
  EXPECT_FALSE(run.end.stopped);
  EXPECT_EQ(run.end.status, 7);
  EXPECT_TRUE(no_child_left());
  EXPECT_EQ(run_script("exit 0", 0).end.status, 0);
  EXPECT_EQ(run_script("kill -TERM $$", 20).end.status, 128 + 15);
}

TEST(Child, ArgumentsAreNotShellParsed) {
  const Lines words = {"a b", "$HOME; exit 9", "", "'\"\\*"};
  EXPECT_EQ(run_script("for word in \"$@\"; do printf '%s\\n' \"$word\"; done", 20, words).lines,
            words);
}

TEST(Child, LinesArriveImmediately) {
  const ScriptRun run = run_script("echo early; sleep 1; echo late", 20);
  ASSERT_EQ(run.lines, (Lines{"early", "late"}));
  EXPECT_GT(run.seconds[1] - run.seconds[0], 0.5);
}

TEST(Child, ManyLongLines) {
  const ScriptRun run =
      run_script("i=0; while [ $i -lt 2000 ]; do printf '%01000d\\n' $i; i=$((i+1)); done", 20);
  ASSERT_EQ(run.lines.size(), 2000u);
  for (std::size_t i = 0; i < run.lines.size(); ++i) {
    ASSERT_EQ(run.lines[i].size(), 1000u);
    ASSERT_EQ(std::stoul(run.lines[i]), i);
  }
}

TEST(Child, IsKilledWithoutOutput) {
  const auto start = Clock::now();
  ScriptRun run = run_script("echo one; exec sleep 60", 0.5);
  EXPECT_TRUE(run.end.stopped);
  EXPECT_EQ(run.lines, Lines{"one"});
  // Text without a line end is not a line.
  run = run_script("while :; do printf x; sleep 0.05; done", 0.5);
  EXPECT_TRUE(run.end.stopped);
  EXPECT_EQ(run.lines, Lines{});
  // Closing the output does not end the child.
  run = run_script("exec >&-; exec sleep 60", 0.5);
  EXPECT_TRUE(run.end.stopped);
  EXPECT_LT(since(start), 30);
  EXPECT_TRUE(no_child_left());
}

TEST(Child, EachLineRestartsTheTimeout) {
  const ScriptRun run = run_script("for i in 1 2 3 4 5 6; do sleep 0.5; echo $i; done", 2);
  EXPECT_FALSE(run.end.stopped);
  EXPECT_EQ(run.lines.size(), 6u);
}

TEST(Child, ListenerExceptionsEndIt) {
  const auto start = Clock::now();
  EXPECT_THROW(run_child("/bin/sh", {"-c", "echo one; exec sleep 60"}, 100,
                         [](const std::string&) { throw std::out_of_range("enough"); }),
               std::out_of_range);
  EXPECT_LT(since(start), 30);
  EXPECT_TRUE(no_child_left());
}

TEST(Child, ReportsAFailedStart) {
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
}  // namespace throng::common
#endif
