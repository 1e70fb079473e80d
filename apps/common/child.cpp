#include "apps/common/child.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

#include "apps/common/failure.hpp"

#ifndef _WIN32
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif
#endif

namespace throng::common {

#ifdef _WIN32

ChildEnd run_child(const std::string& path, const std::vector<std::string>&, double,
                   const std::function<void(const std::string&)>&) {
  throw Failure(fmt::format("{}: running another program is not available on Windows", path));
}

#else

namespace {

[[noreturn]] void cannot_start(const std::string& path, int error) {
  throw Failure(fmt::format("{} cannot be started: {}", path, std::strerror(error)));
}

// One end of a pipe; child processes do not inherit it.
class End {
 public:
  ~End() { close(); }
  End() = default;
  End(const End&) = delete;
  End& operator=(const End&) = delete;
  void reset(int fd) {
    fd_ = fd;
    fcntl(fd, F_SETFD, FD_CLOEXEC);
  }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  int fd() const { return fd_; }

 private:
  int fd_ = -1;
};

struct Pipe {
  explicit Pipe(const std::string& path) {
    int ends[2];
    if (pipe(ends) != 0) cannot_start(path, errno);
    from.reset(ends[0]);
    to.reset(ends[1]);
  }
  End from, to;
};

// Retries when a signal interrupts the read.
ssize_t read_some(int fd, void* into, std::size_t bytes) {
  for (;;) {
    const ssize_t got = read(fd, into, bytes);
    if (got >= 0 || errno != EINTR) return got;
  }
}

// A running child process. The destructor kills it if it still runs.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  ~Child() { kill(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void kill() {
    if (ended_) return;
    ::kill(pid_, SIGKILL);
    wait(0);
  }
  // Whether it has ended; with WNOHANG as flags without waiting.
  bool wait(int flags) {
    int status = 0;
    pid_t got;
    do {
      got = waitpid(pid_, &status, flags);
    } while (got < 0 && errno == EINTR);
    if (got == 0) return false;
    ended_ = true;
    if (got == pid_) status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return true;
  }
  int status() const { return status_; }

 private:
  pid_t pid_;
  bool ended_ = false;
  int status_ = 128 + SIGKILL;
};

using Clock = std::chrono::steady_clock;

// Since the last line.
class SilenceTimer {
 public:
  explicit SilenceTimer(double seconds) : seconds_(seconds) {}
  void restart() { last_ = Clock::now(); }
  // For poll: rounded up, so that nothing is left at the timeout; -1: no limit.
  int milliseconds_left() const {
    if (!(seconds_ > 0)) return -1;
    const std::chrono::duration<double> elapsed = Clock::now() - last_;
    return static_cast<int>(std::clamp((seconds_ - elapsed.count()) * 1000 + 0.999, 0.0, 1e9));
  }

 private:
  double seconds_;
  Clock::time_point last_ = Clock::now();
};

// In the child, after fork: only async-signal-safe calls, as the parent had other threads.
[[noreturn]] void exec_program(const char* path, char* const* argv, int out, int report) {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // no process would read it any more
#endif
  signal(SIGPIPE, SIG_DFL);          // an ignored signal would stay ignored in the other program
  const int nothing = open("/dev/null", O_RDONLY);
  if (nothing >= 0 && dup2(nothing, STDIN_FILENO) >= 0 && dup2(out, STDOUT_FILENO) >= 0) {
    if (nothing > STDERR_FILENO) close(nothing);
    execv(path, argv);
  }
  const int error = errno;
  [[maybe_unused]] const ssize_t sent = write(report, &error, sizeof error);
  _exit(127);
}

// Removes the complete lines from `text` and returns them.
void forward_lines(std::string& text, const std::function<void(const std::string&)>& line,
                   SilenceTimer& silence_timer) {
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    line(text.substr(begin, end - begin));
    silence_timer.restart();
  }
  text.erase(0, begin);
}

}  // namespace

ChildEnd run_child(const std::string& path, const std::vector<std::string>& arguments,
                   double quiet_seconds, const std::function<void(const std::string&)>& line) {
  std::vector<char*> argv = {const_cast<char*>(path.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  Pipe out(path), report(path);  // the second closes silently when exec succeeds
  std::fflush(stdout);
  const pid_t pid = fork();
  if (pid < 0) cannot_start(path, errno);
  if (pid == 0) exec_program(path.c_str(), argv.data(), out.to.fd(), report.to.fd());
  Child child(pid);
  out.to.close();
  report.to.close();
  int error = 0;
  if (read_some(report.from.fd(), &error, sizeof error) == sizeof error) cannot_start(path, error);

  SilenceTimer silence_timer(quiet_seconds);
  std::string text;
  const auto stop = [&] {
    child.kill();
    return ChildEnd{true, child.status()};
  };
  for (;;) {
    pollfd waiting{out.from.fd(), POLLIN, 0};
    const int left = silence_timer.milliseconds_left();
    const int ready = poll(&waiting, 1, left);
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0) return stop();
    char some[4096];
    const ssize_t got = read_some(out.from.fd(), some, sizeof some);
    if (got <= 0) break;
    text.append(some, static_cast<std::size_t>(got));
    forward_lines(text, line, silence_timer);
    if (silence_timer.milliseconds_left() == 0)
      return stop();  // output without a line end also counts as activity
  }
  if (!text.empty()) {
    line(text);
    silence_timer.restart();
  }
  // It may run on after closing its output.
  for (timespec pause{0, 1000000}; !child.wait(WNOHANG); nanosleep(&pause, nullptr)) {
    if (silence_timer.milliseconds_left() == 0) return stop();
  }
  return {false, child.status()};
}

#endif

}  // namespace throng::common
