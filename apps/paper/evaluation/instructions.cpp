#include "apps/paper/evaluation/instructions.hpp"

#if defined(__linux__)
#include <csignal>

#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

namespace throng::paper {
namespace {

// From one stop signal of the child to the next; nothing where tracing is not possible.
std::optional<std::uint64_t> steps_of(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child < 0) return {};
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(1);
    std::raise(SIGSTOP);
    work();
    std::raise(SIGSTOP);
    _exit(0);
  }
  int status = 0;
  const auto stopped_by = [&](int signal) {
    return WIFSTOPPED(status) && WSTOPSIG(status) == signal;
  };
  std::optional<std::uint64_t> result;
  if (waitpid(child, &status, 0) == child && stopped_by(SIGSTOP)) {
    std::uint64_t steps = 0;
    for (;;) {
      if (ptrace(PTRACE_SINGLESTEP, child, nullptr, nullptr) != 0) break;
      if (waitpid(child, &status, 0) != child || WIFEXITED(status)) break;
      if (stopped_by(SIGSTOP)) {
        result = steps;
        break;
      }
      ++steps;
    }
  }
  kill(child, SIGKILL);
  waitpid(child, &status, 0);
  return result;
}

}  // namespace

std::optional<std::uint64_t> count_instructions(const std::function<void()>& work) {
  const auto nothing = steps_of([] {});
  const auto all = steps_of(work);
  if (!nothing || !all || *all < *nothing) return {};
  return *all - *nothing;
}

}  // namespace throng::paper

#else

namespace throng::paper {

std::optional<std::uint64_t> count_instructions(const std::function<void()>&) { return {}; }

}  // namespace throng::paper
#endif
