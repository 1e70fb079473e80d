#include "support/process.hpp"

#include <cstdlib>

#ifdef _WIN32
#include <windows.h>
#else
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#endif

namespace throng::test {

#ifdef _WIN32

namespace {

HANDLE open_inherited(const std::string& path, DWORD access, DWORD how) {
  SECURITY_ATTRIBUTES inherited{sizeof(SECURITY_ATTRIBUTES), nullptr, TRUE};
  return CreateFileA(path.c_str(), access, FILE_SHARE_READ | FILE_SHARE_WRITE, &inherited, how, 0,
                     nullptr);
}

// The words of a command line, as the C runtime of the program splits it again.
void append_quoted(std::string& line, const std::string& word) {
  line += line.empty() ? "\"" : " \"";
  std::size_t backslashes = 0;
  for (const char c : word) {
    if (c == '"') line.append(backslashes + 1, '\\');
    backslashes = c == '\\' ? backslashes + 1 : 0;
    line += c;
  }
  line.append(backslashes, '\\');
  line += '"';
}

}  // namespace

Process start(const std::string& program, const std::vector<std::string>& arguments,
              const std::string& out, const std::string& err, const std::filesystem::path& folder,
              const Limits&) {
  std::string line;
  append_quoted(line, program);
  for (const std::string& argument : arguments) append_quoted(line, argument);
  STARTUPINFOA startup{};
  startup.cb = sizeof startup;
  startup.dwFlags = STARTF_USESTDHANDLES;
  startup.hStdInput = open_inherited("NUL", GENERIC_READ, OPEN_EXISTING);
  startup.hStdOutput = open_inherited(out, GENERIC_WRITE, CREATE_ALWAYS);
  startup.hStdError = open_inherited(err, GENERIC_WRITE, CREATE_ALWAYS);
  PROCESS_INFORMATION process{};
  const bool started = CreateProcessA(program.c_str(), line.data(), nullptr, nullptr, TRUE, 0,
                                      nullptr, folder.string().c_str(), &startup, &process) != 0;
  for (HANDLE handle : {startup.hStdInput, startup.hStdOutput, startup.hStdError})
    CloseHandle(handle);
  if (!started) return nullptr;
  CloseHandle(process.hThread);
  return process.hProcess;
}

int wait_for(Process process) {
  if (!process) return 127;
  DWORD status = 0;
  WaitForSingleObject(process, INFINITE);
  GetExitCodeProcess(process, &status);
  CloseHandle(process);
  return static_cast<int>(status);
}

void set_environment(const std::string& name, const char* value) {
  _putenv_s(name.c_str(), value ? value : "");
}

#else

Process start(const std::string& program, const std::vector<std::string>& arguments,
              const std::string& out, const std::string& err, const std::filesystem::path& folder,
              const Limits& limits) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  const int in_fd = open("/dev/null", O_RDONLY);
  const int out_fd = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int err_fd = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  dup2(in_fd, 0);
  dup2(out_fd, 1);
  dup2(err_fd, 2);
  if (chdir(folder.c_str()) != 0) _exit(126);
  const auto limit = [](auto what, std::uint64_t value) {
    const auto most = static_cast<rlim_t>(value);
    const rlimit r{most, most};
    if (value != Limits::none && setrlimit(what, &r) != 0) _exit(126);
  };
  limit(RLIMIT_AS, limits.address_space);
  limit(RLIMIT_FSIZE, limits.file_size);
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  _exit(127);
}

int wait_for(Process process) {
  int status = 0;
  if (waitpid(process, &status, 0) != process) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void set_environment(const std::string& name, const char* value) {
  if (value) {
    setenv(name.c_str(), value, 1);
  } else {
    unsetenv(name.c_str());
  }
}

#endif

}  // namespace throng::test
