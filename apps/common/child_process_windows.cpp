#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <system_error>

#include <fmt/format.h>

#include "apps/common/child_process.hpp"
#include "apps/common/failure.hpp"

namespace throng::common {
namespace {

constexpr int killed = 128 + 9;  // as SIGKILL elsewhere

[[noreturn]] void cannot_start(const std::string& path, DWORD error) {
  // Wine and older runtimes know few messages.
  throw Failure(fmt::format("{} cannot be started: {} (Windows error {})", path,
                            std::system_category().message(static_cast<int>(error)), error));
}

class Handle {
 public:
  ~Handle() { close(); }
  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  void reset(HANDLE handle) {
    close();
    handle_ = handle;
  }
  void close() {
    if (handle_ && handle_ != INVALID_HANDLE_VALUE) CloseHandle(handle_);
    handle_ = nullptr;
  }
  HANDLE get() const { return handle_; }

 private:
  HANDLE handle_ = nullptr;
};

// Windows passes one string, which the program's C runtime splits: words in quotes, and a backslash
// before each quote and each backslash that precedes one.
void append_quoted(std::string& line, const std::string& word) {
  if (!line.empty()) line += ' ';
  line += '"';
  std::size_t backslashes = 0;
  for (const char c : word) {
    if (c == '"') line.append(backslashes + 1, '\\');
    backslashes = c == '\\' ? backslashes + 1 : 0;
    line += c;
  }
  line.append(backslashes, '\\');
  line += '"';
}

// Starts it with these standard handles; returns the handle of the process.
HANDLE start(const std::string& path, const std::vector<std::string>& arguments,
             STARTUPINFOA& startup) {
  std::string line;
  append_quoted(line, path);
  for (const std::string& argument : arguments) append_quoted(line, argument);
  startup.cb = sizeof startup;
  startup.dwFlags = STARTF_USESTDHANDLES;
  startup.hStdError = GetStdHandle(STD_ERROR_HANDLE);
  std::fflush(stdout);
  PROCESS_INFORMATION process{};
  if (!CreateProcessA(path.c_str(), line.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr,
                      &startup, &process)) {
    cannot_start(path, GetLastError());
  }
  CloseHandle(process.hThread);
  return process.hProcess;
}

int wait_for_status(HANDLE process) {
  WaitForSingleObject(process, INFINITE);
  DWORD status = 0;
  GetExitCodeProcess(process, &status);
  return static_cast<int>(status);
}

}  // namespace

struct ChildProcess::State {
  Handle process, out;
  bool ended = false;
  int status = killed;
};

ChildProcess::ChildProcess(const std::string& path, const std::vector<std::string>& arguments)
    : state_(std::make_unique<State>()) {
  SECURITY_ATTRIBUTES inherited{sizeof(SECURITY_ATTRIBUTES), nullptr, TRUE};
  HANDLE from = nullptr, to = nullptr;
  if (!CreatePipe(&from, &to, &inherited, 0)) cannot_start(path, GetLastError());
  state_->out.reset(from);
  SetHandleInformation(from, HANDLE_FLAG_INHERIT, 0);
  Handle output, nothing;  // the child has its own copies
  output.reset(to);
  nothing.reset(CreateFileA("NUL", GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE, &inherited,
                            OPEN_EXISTING, 0, nullptr));
  STARTUPINFOA startup{};
  startup.hStdInput = nothing.get();
  startup.hStdOutput = to;
  state_->process.reset(start(path, arguments, startup));
}

ChildProcess::~ChildProcess() { kill(); }

std::optional<std::size_t> ChildProcess::read(char* into, std::size_t bytes, int milliseconds) {
  // A read of a pipe cannot have a timeout: looks every few milliseconds.
  constexpr int most = 10;
  DWORD available = 0;
  for (int passed = 0, pause = 1;; passed += pause, pause = std::min(pause * 2, most)) {
    if (!PeekNamedPipe(state_->out.get(), nullptr, 0, nullptr, &available, nullptr)) return 0;
    if (available != 0) break;
    if (milliseconds >= 0 && passed >= milliseconds) return std::nullopt;
    Sleep(static_cast<DWORD>(pause));
  }
  DWORD got = 0;
  const auto some = static_cast<DWORD>(std::min<std::size_t>(bytes, available));
  return ReadFile(state_->out.get(), into, some, &got, nullptr) ? got : 0;
}

bool ChildProcess::has_ended() {
  if (!state_->ended && WaitForSingleObject(state_->process.get(), 0) == WAIT_OBJECT_0) {
    state_->status = wait_for_status(state_->process.get());
    state_->ended = true;
  }
  return state_->ended;
}

void ChildProcess::kill() {
  if (state_->ended) return;
  TerminateProcess(state_->process.get(), killed);
  state_->status = wait_for_status(state_->process.get());
  state_->ended = true;
}

int ChildProcess::status() const { return state_->status; }

int run_instead(const std::string& path, const std::vector<std::string>& arguments) {
  STARTUPINFOA startup{};
  startup.hStdInput = GetStdHandle(STD_INPUT_HANDLE);
  startup.hStdOutput = GetStdHandle(STD_OUTPUT_HANDLE);
  Handle process;
  process.reset(start(path, arguments, startup));
  std::signal(SIGINT, SIG_IGN);  // Ctrl-C goes to both; the other program decides
  return wait_for_status(process.get());
}

}  // namespace throng::common
