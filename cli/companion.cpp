#include "cli/companion.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "cli/failure.hpp"
#include "cli/interrupt.hpp"

#ifdef _WIN32
#define NOMINMAX
#include <process.h>
#include <windows.h>
#else
#include <unistd.h>
#endif
#ifdef __APPLE__
#include <mach-o/dyld.h>
#endif

namespace throng::cli {
namespace {

namespace fs = std::filesystem;

fs::path own_folder() {
  std::error_code error;
#if defined(_WIN32)
  wchar_t name[32768];
  const DWORD length = GetModuleFileNameW(nullptr, name, 32768);
  return length ? fs::path(name, name + length).parent_path() : fs::path();
#elif defined(__APPLE__)
  char name[4096];
  std::uint32_t size = sizeof name;
  if (_NSGetExecutablePath(name, &size) != 0) return {};
  return fs::canonical(name, error).parent_path();
#else
  return fs::read_symlink("/proc/self/exe", error).parent_path();
#endif
}

}  // namespace

std::string find_companion(const std::string& program) {
  const fs::path folder = own_folder();
  if (folder.empty()) return {};
#ifdef _WIN32
  const fs::path path = folder / (program + ".exe");
#else
  const fs::path path = folder / program;
#endif
  std::error_code error;
  return fs::is_regular_file(path, error) ? path.string() : std::string();
}

int start_companion(const std::string& path, const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  argv.push_back(const_cast<char*>(path.c_str()));
  for (const std::string& argument : arguments) {
    argv.push_back(const_cast<char*>(argument.c_str()));
  }
  argv.push_back(nullptr);
  std::fflush(stdout);
  restore_broken_pipes();  // an ignored signal would stay ignored in the other program
#ifdef _WIN32
  const auto status = _spawnv(_P_WAIT, path.c_str(), argv.data());
  if (status >= 0) return static_cast<int>(status);
#else
  execv(path.c_str(), argv.data());  // an argument vector: no shell, nothing to quote
#endif
  throw Failure(fmt::format("{} cannot be started: {}", path, std::strerror(errno)));
}

}  // namespace throng::cli
