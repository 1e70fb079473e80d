#include "apps/common/sibling_program.hpp"

#include <cstdint>
#include <filesystem>
#include <system_error>

#ifdef _WIN32
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
#endif
#ifdef __APPLE__
#include <mach-o/dyld.h>
#endif

namespace throng::common {
namespace {

namespace fs = std::filesystem;

fs::path program_folder() {
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

std::string find_sibling_program(const std::string& program) {
  const fs::path folder = program_folder();
  if (folder.empty()) return {};
#ifdef _WIN32
  const fs::path path = folder / (program + ".exe");
#else
  const fs::path path = folder / program;
#endif
  std::error_code error;
  return fs::is_regular_file(path, error) ? path.string() : std::string();
}

}  // namespace throng::common
