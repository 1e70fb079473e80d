#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

#include "apps/common/child_process.hpp"
#include "apps/common/failure.hpp"

namespace throng::common {
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
    const ssize_t got = ::read(fd, into, bytes);
    if (got >= 0 || errno != EINTR) return got;
  }
}

std::vector<char*> argument_vector(const std::string& path,
                                   const std::vector<std::string>& arguments) {
  std::vector<char*> argv = {const_cast<char*>(path.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  return argv;
}

// In the child, after fork: only async-signal-safe calls, as the parent had other threads.
[[noreturn]] void exec_program(const char* path, char* const* argv, int out, int report) {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // no process would read it any more
#endif
  signal(SIGPIPE, SIG_DFL);  // an ignored signal would stay ignored in the other program
  const int nothing = open("/dev/null", O_RDONLY);
  if (nothing >= 0 && dup2(nothing, STDIN_FILENO) >= 0 && dup2(out, STDOUT_FILENO) >= 0) {
    if (nothing > STDERR_FILENO) close(nothing);
    execv(path, argv);
  }
  const int error = errno;
  [[maybe_unused]] const ssize_t sent = write(report, &error, sizeof error);
  _exit(127);
}

}  // namespace

struct ChildProcess::State {
  explicit State(const std::string& path) : out(path) {}

  // Whether it has ended; with WNOHANG as flags without waiting.
  bool wait(int flags) {
    if (ended) return true;
    int how = 0;
    pid_t got;
    do {
      got = waitpid(pid, &how, flags);
    } while (got < 0 && errno == EINTR);
    if (got == 0) return false;
    ended = true;
    if (got == pid) status = WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how);
    return true;
  }

  Pipe out;
  pid_t pid = -1;
  bool ended = true;
  int status = 128 + SIGKILL;
};

ChildProcess::ChildProcess(const std::string& path, const std::vector<std::string>& arguments)
    : state_(std::make_unique<State>(path)) {
  const std::vector<char*> argv = argument_vector(path, arguments);
  Pipe report(path);  // closes silently when exec succeeds
  std::fflush(stdout);
  state_->pid = fork();
  if (state_->pid < 0) cannot_start(path, errno);
  if (state_->pid == 0) {
    exec_program(path.c_str(), argv.data(), state_->out.to.fd(), report.to.fd());
  }
  state_->ended = false;
  state_->out.to.close();
  report.to.close();
  int error = 0;
  if (read_some(report.from.fd(), &error, sizeof error) == sizeof error) {
    state_->wait(0);
    cannot_start(path, error);
  }
}

ChildProcess::~ChildProcess() { kill(); }

std::optional<std::size_t> ChildProcess::read(char* into, std::size_t bytes, int milliseconds) {
  pollfd waiting{state_->out.from.fd(), POLLIN, 0};
  int ready;
  do {
    ready = poll(&waiting, 1, milliseconds);
  } while (ready < 0 && errno == EINTR);
  if (ready == 0) return std::nullopt;
  const ssize_t got = read_some(waiting.fd, into, bytes);
  return got > 0 ? static_cast<std::size_t>(got) : 0;
}

bool ChildProcess::has_ended() { return state_->wait(WNOHANG); }

void ChildProcess::kill() {
  if (state_->ended) return;
  ::kill(state_->pid, SIGKILL);
  state_->wait(0);
}

int ChildProcess::status() const { return state_->status; }

int run_instead(const std::string& path, const std::vector<std::string>& arguments) {
  std::fflush(stdout);
  execv(path.c_str(), argument_vector(path, arguments).data());
  cannot_start(path, errno);
}

}  // namespace throng::common
