// Starts a built program, with its output in files.
#pragma once

#ifndef _WIN32
#include <signal.h>
#include <sys/types.h>
#include <unistd.h>
#endif

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace throng::test {

#ifdef _WIN32
using Process = void*;  // a handle
#else
using Process = pid_t;
#endif

// What a process may use. Windows has no such limits: ignored there.
struct Limits {
  static constexpr std::uint64_t none = ~std::uint64_t{0};
  std::uint64_t address_space = none;
  std::uint64_t file_size = none;
  std::string out_path;  // standard output goes there instead of to `out`
};

// Nothing is on its standard input. If it cannot be started, the exit status is 126 or 127.
Process start(const std::string& program, const std::vector<std::string>& arguments,
              const std::string& out, const std::string& err, const std::filesystem::path& folder,
              const Limits& limits);

// Its exit status; 128 + the signal that ended it. Call it once.
int wait_for(Process process);

// An environment variable of this process, and of those that it starts; null: none.
void set_environment(const std::string& name, const char* value);

}  // namespace throng::test
