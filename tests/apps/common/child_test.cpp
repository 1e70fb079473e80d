// A child program's lines arrive while it runs, and one without output is stopped. The child is
// child_program.cpp.
#include <gtest/gtest.h>

#ifndef _WIN32
#include <signal.h>
#include <sys/wait.h>
#endif

#include <cerrno>
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

using Lines = std::vector<std::string>;

struct ChildRun {
  ChildEnd end;
  Lines lines;
  std::vector<double> seconds;  // after the start
};

ChildRun run_steps(const std::vector<std::string>& steps, double quiet_seconds) {
  ChildRun run;
  const auto start = Clock::now();
  run.end = run_child(THRONG_CHILD, steps, quiet_seconds, [&](const std::string& line) {
    run.lines.push_back(line);
    run.seconds.push_back(since(start));
  });
  return run;
}

bool no_child_left() {
#ifdef _WIN32
  return true;  // there are no zombies
#else
  return waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD;
#endif
}

TEST(Child, EachLineAndTheStatus) {
  const ChildRun some = run_steps(
      {"print", "one\n\n", "print", "two\nthree", "complain", "unheard\n", "exit", "7"}, 20);
  EXPECT_EQ(some.lines, (Lines{"one", "", "two", "three"}));
  EXPECT_FALSE(some.end.stopped);
  EXPECT_EQ(some.end.status, 7);
  EXPECT_TRUE(no_child_left());
  EXPECT_EQ(run_steps({"exit", "0"}, 0).end.status, 0);
}

TEST(Child, ArgumentsAreNotShellParsed) {
  const Lines words = {"a b", "$HOME; exit 9", "", "'\"\\*", "C:\\folder\\", "\\\\\"", "%PATH%"};
  Lines steps = {"words"};
  steps.insert(steps.end(), words.begin(), words.end());
  EXPECT_EQ(run_steps(steps, 20).lines, words);
}

TEST(Child, LinesArriveImmediately) {
  const ChildRun two = run_steps({"print", "early\n", "sleep", "1000", "print", "late\n"}, 20);
  ASSERT_EQ(two.lines, (Lines{"early", "late"}));
  EXPECT_GT(two.seconds[1] - two.seconds[0], 0.5);
}

TEST(Child, ManyLongLines) {
  const ChildRun many = run_steps({"lines", "2000", "1000"}, 20);
  ASSERT_EQ(many.lines.size(), 2000u);
  for (std::size_t i = 0; i < many.lines.size(); ++i) {
    ASSERT_EQ(many.lines[i].size(), 1000u);
    ASSERT_EQ(std::stoul(many.lines[i]), i);
  }
}

TEST(Child, IsKilledWithoutOutput) {
  const auto start = Clock::now();
  ChildRun one = run_steps({"print", "one\n", "sleep", "60000"}, 0.5);
  EXPECT_TRUE(one.end.stopped);
  EXPECT_EQ(one.end.status, 128 + 9);
  EXPECT_EQ(one.lines, Lines{"one"});
  // Text without a line end is not a line.
  one = run_steps({"repeat", "x", "50"}, 0.5);
  EXPECT_TRUE(one.end.stopped);
  EXPECT_EQ(one.lines, Lines{});
  // Closing the output does not end the child.
  one = run_steps({"close", "sleep", "60000"}, 0.5);
  EXPECT_TRUE(one.end.stopped);
  EXPECT_LT(since(start), 30);
  EXPECT_TRUE(no_child_left());
}

TEST(Child, EachLineRestartsTheTimeout) {
  Lines steps;
  for (int i = 0; i < 6; ++i) steps.insert(steps.end(), {"sleep", "500", "print", "line\n"});
  const ChildRun slow = run_steps(steps, 2);
  EXPECT_FALSE(slow.end.stopped);
  EXPECT_EQ(slow.lines.size(), 6u);
}

TEST(Child, ListenerExceptionsEndIt) {
  const auto start = Clock::now();
  EXPECT_THROW(run_child(THRONG_CHILD, {"print", "one\n", "sleep", "60000"}, 100,
                         [](const std::string&) { throw std::out_of_range("enough"); }),
               std::out_of_range);
  EXPECT_LT(since(start), 30);
  EXPECT_TRUE(no_child_left());
}

TEST(Child, ReportsAFailedStart) {
  for (const std::string path : {"/no/such/program", "/"}) {
    try {
      run_child(path, {}, 1, [](const std::string&) {});
      ADD_FAILURE() << path;
    } catch (const Failure& failure) {
      EXPECT_NE(std::string(failure.what()).find(path + " cannot be started: "), std::string::npos)
          << failure.what();
      EXPECT_EQ(failure.status(), exit_bad);
    }
  }
  EXPECT_TRUE(no_child_left());
}

#ifndef _WIN32
TEST(Child, ASignalIsAStatus) {
  const auto kill_it = [](const std::string& pid) { kill(std::stoi(pid), SIGTERM); };
  const ChildEnd end = run_child("/bin/sh", {"-c", "echo $$; exec sleep 60"}, 20, kill_it);
  EXPECT_FALSE(end.stopped);
  EXPECT_EQ(end.status, 128 + SIGTERM);
}
#endif

}  // namespace
}  // namespace throng::common
